#include "controllers/factory.hpp"

#include "controllers/baselines/extended_cost.hpp"
#include "controllers/baselines/law_controller.hpp"
#include "controllers/baselines/pulse_width_pid.hpp"
#include "controllers/baselines/switching_hybrid.hpp"
#include "controllers/mpc_controller.hpp"
#include "controllers/relaxed_controller.hpp"
#include "controllers/relaxed_solvers.hpp"
#include "core/actuator/valves.hpp"
#include "solvers/minlp/bonmin.hpp"
#include "solvers/rounding/projected_gradient.hpp"
#include "solvers/rounding/relax_and_round.hpp"
#include "solvers/search/branch_and_bound.hpp"
#include "solvers/search/rollout_kernels.hpp"

namespace solenoid {
namespace {

Horizon make_horizon(const VariantConfig& v) {
  Horizon horizon{tick_s, {}};
  for (const int periods : v.blocks) horizon.blocks.push_back(periods * ticks_per_period);
  if (horizon.blocks.empty()) horizon.blocks = {v.steps};
  return horizon;
}

template <HybridModel Model>
Cost<Model> make_cost(const VariantConfig& v) {
  Cost<Model> cost;
  cost.tracking = {v.position_weight, v.velocity_weight};
  cost.terminal = {v.terminal_position_weight, v.terminal_velocity_weight};
  cost.switching = v.switching_weight;
  cost.consumption = v.air_weight;
  cost.continuous = {v.motor_weight};
  return cost;
}

MotorLaw make_motor(const VariantConfig& v, const PneumaticActuator& model) {
  if (v.motor == "pd" || v.predicts_motor()) return PdMotor(model, v.motor_gains);
  if (v.motor == "inverse_dynamics") return InverseDynamicsMotor(model, v.motor_gains);
  return NoMotor{};
}

template <HybridModel Model>
Model make_model(const VariantConfig& v, Plane plane) {
  ActuatorParameters believed = v.believed;
  believed.plane = plane;
  if constexpr (HasFeedback<Model>)
    return Model(believed, v.motor_gains);
  else
    return Model(believed);
}

template <HybridModel Model>
std::unique_ptr<Controller> make_relaxed(const VariantConfig& v, const Trajectory& reference, Plane plane) {
  using Relaxed = RelaxedController<Model>;
  Problem<Model> problem = make_problem<Model>(v, plane);
  const double limit_n = v.motor == "joint" ? problem.model.parameters().motor_force_limit_n() : 0.0;
  problem.bounds.continuous_lower = {-limit_n}, problem.bounds.continuous_upper = {limit_n};
  MotorLaw motor = make_motor(v, problem.model);
  Estimator estimator(v.estimator, problem.model, v.estimation);
  RelaxedGrid grid = control_grid(problem.horizon, ticks_per_period);
  auto solver = make_relaxed_solver<Model>(v.solver, problem);
  return std::make_unique<Relaxed>(typename Relaxed::Parts{std::move(problem), std::move(grid), std::move(solver),
                                                           reference, v.integral, motor, v.motor == "joint",
                                                           v.deadline_ms, std::move(estimator), v.use_estimate});
}

template <class Law, class... Settings>
std::unique_ptr<Controller> make_law(const VariantConfig& v, const Trajectory& reference, Plane plane,
                                     const Settings&... settings) {
  const auto model = make_model<PneumaticActuator>(v, plane);
  ModeSet modes = valve_modes(v.valves, model.parameters());
  Law law(settings..., modes);
  return std::make_unique<LawController<Law>>(
      typename LawController<Law>::Parts{model, std::move(modes), std::move(law), reference, make_motor(v, model),
                                         Estimator(v.estimator, model, v.estimation), v.use_estimate});
}

std::unique_ptr<Controller> make_lawful(const VariantConfig& v, const Trajectory& reference, Plane plane) {
  if (v.solver == "pulse_width_pid") return make_law<PulseWidthPid>(v, reference, plane, v.pulse_width);
  if (v.solver == "three_mode_sliding") return make_law<ThreeModeSliding>(v, reference, plane, v.sliding);
  return make_law<SwitchingHybrid>(v, reference, plane, v.phases, v.sliding);
}

template <HybridModel Model>
std::unique_ptr<Controller> make_mpc(const VariantConfig& v, const Trajectory& reference, Plane plane,
                                     SolverWrapper* wrapper) {
  if (v.relaxed()) return make_relaxed<Model>(v, reference, plane);
  using Mpc = MpcController<Model>;
  Problem<Model> problem = make_problem<Model>(v, plane);
  MotorLaw motor = make_motor(v, problem.model);
  Estimator estimator(v.estimator, problem.model, v.estimation);
  std::unique_ptr<Solver<Model>> solver = make_solver<Model>(v);
  if (wrapper) solver = wrapper->wrap(std::move(solver));
  return std::make_unique<Mpc>(typename Mpc::Parts{std::move(problem), std::move(solver), reference, v.integral, motor,
                                                   v.deadline_ms, std::move(estimator), v.use_estimate,
                                                   v.latency_ticks});
}

}  // namespace

template <HybridModel Model>
Problem<Model> make_problem(const VariantConfig& v, Plane plane) {
  const Model model = make_model<Model>(v, plane);
  // What a plan adds to the motor's law is the solver's to choose in joint plans, and nothing in others.
  const double most = v.motor == "joint" ? 2.0 * model.parameters().motor_force_limit_n() : 0.0;
  Bounds<Model> bounds;
  bounds.continuous_lower = {-most};
  bounds.continuous_upper = {most};
  return {model, valve_modes(v.valves, model.parameters()), make_horizon(v), make_cost<Model>(v), bounds};
}

template <HybridModel Model>
std::unique_ptr<Solver<Model>> make_solver(const VariantConfig& v) {
  const std::string& name = v.solver;
  if (v.lawful()) throw std::invalid_argument("'" + name + "' is a law, it has no solver");
  if (name == "exhaustive") return std::make_unique<BranchAndBound<Model>>(TreeSearchSettings{.prune = false});
  if (name == "branch_and_bound") return std::make_unique<BranchAndBound<Model>>();
  if (name == "extended_cost") return std::make_unique<ExtendedCostSearch<Model>>(v.terminal_acceleration_weight);
  if (name == "sum_up_rounding" || name == "cia") {
    RelaxAndRoundSettings settings;
    if (name == "cia") settings.method = RoundingMethod::integral_approximation;
    settings.improve = v.rounding_improves;
    auto relaxed = std::make_unique<ProjectedGradient<Model>>(
        ProjectedGradientSettings{.most_iterations = v.relaxing_iterations, .tolerance = 1e-4});
    return std::make_unique<RelaxAndRound<Model>>(std::move(relaxed), settings);
  }
  if (name == "bonmin") return std::make_unique<BonminSolver<Model>>();
  throw std::invalid_argument("solver '" + name + "' is not known");
}

template Problem<PneumaticActuator> make_problem(const VariantConfig&, Plane);
template Problem<PrestabilisedActuator> make_problem(const VariantConfig&, Plane);
template std::unique_ptr<Solver<PneumaticActuator>> make_solver(const VariantConfig&);
template std::unique_ptr<Solver<PrestabilisedActuator>> make_solver(const VariantConfig&);

std::unique_ptr<Controller> make_controller(const VariantConfig& v, const Trajectory& reference, Plane plane,
                                            SolverWrapper* wrapper) {
  if (v.lawful()) return make_lawful(v, reference, plane);
  if (v.predicts_motor()) return make_mpc<PrestabilisedActuator>(v, reference, plane, wrapper);
  return make_mpc<PneumaticActuator>(v, reference, plane, wrapper);
}

CommandLimits make_limits(const VariantConfig& v) {
  return {valve_modes(v.valves, v.believed), v.believed.motor_force_limit_n()};
}

}  // namespace solenoid
