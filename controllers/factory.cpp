#include "controllers/factory.hpp"

#include "controllers/mpc_controller.hpp"

namespace solenoid {
namespace {

Horizon make_horizon(const VariantConfig& v) {
  Horizon horizon{tick_s, {}};
  if (solver_row(v.solver).pulses) {
    horizon.blocks.assign(static_cast<std::size_t>(v.horizon.steps), 1);
    return horizon;
  }
  for (const int periods : v.horizon.blocks) horizon.blocks.push_back(periods * ticks_per_period);
  if (horizon.blocks.empty()) horizon.blocks = {v.horizon.steps};
  return horizon;
}

template <HybridModel Model>
Cost<Model> make_cost(const CostSettings& weights) {
  Cost<Model> cost;
  cost.tracking = {weights.position, weights.velocity};
  cost.terminal = {weights.terminal_position, weights.terminal_velocity};
  cost.switching = weights.switching;
  cost.consumption = weights.air;
  cost.continuous = {weights.motor};
  return cost;
}

template <HybridModel Model>
std::unique_ptr<Controller> make_mpc(const VariantConfig& v, const Trajectory& reference, Plane plane,
                                     const SolverDecorator& decorate) {
  AnySolver solver = make_solver<Model>(v);
  if (decorate) solver = decorate(std::move(solver));
  return make_shell(v, reference, plane,
                    MpcController<Model>({make_problem<Model>(v, plane), std::get<SolverPtr<Model>>(std::move(solver)),
                                          v.integral, v.deadline_ms, v.latency_ticks}));
}

}  // namespace

MotorLaw make_motor(const VariantConfig& v, const PneumaticActuator& model) {
  if (v.motor == "pd" || v.predicts_motor()) return PdMotor(model, v.motor_gains);
  if (v.motor == "inverse_dynamics") return InverseDynamicsMotor(model, v.motor_gains);
  return NoMotor{};
}

template <HybridModel Model>
Problem<Model> make_problem(const VariantConfig& v, Plane plane) {
  const Model model = make_model<Model>(v, plane);
  // What a plan adds to the motor's law is the solver's to choose in joint plans, and nothing in others. It may turn
  // the law's whole force round.
  const double most =
      v.motor == "joint" ? (HasFeedback<Model> ? 2.0 : 1.0) * model.parameters().motor_force_limit_n() : 0.0;
  Bounds<Model> bounds;
  bounds.continuous_lower = {-most};
  bounds.continuous_upper = {most};
  return {model, valve_modes(v.valves, model.parameters()), make_horizon(v), make_cost<Model>(v.cost), bounds};
}

template Problem<PneumaticActuator> make_problem(const VariantConfig&, Plane);
template Problem<PrestabilisedActuator> make_problem(const VariantConfig&, Plane);

std::unique_ptr<Controller> make_controller(const VariantConfig& v, const Trajectory& reference, Plane plane,
                                            const SolverDecorator& decorate) {
  if (const LawRow* law = find_row(law_rows(), v.solver)) return law->make(v, reference, plane);
  if (v.predicts_motor()) return make_mpc<PrestabilisedActuator>(v, reference, plane, decorate);
  return make_mpc<PneumaticActuator>(v, reference, plane, decorate);
}

CommandLimits make_limits(const VariantConfig& v) {
  return {valve_modes(v.valves, v.nominal), v.nominal.motor_force_limit_n()};
}

}  // namespace solenoid
