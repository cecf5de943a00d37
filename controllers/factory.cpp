#include "controllers/factory.hpp"

#include "controllers/mpc_controller.hpp"
#include "controllers/systems/actuator/actuator_guard.hpp"
#include "core/systems/actuator/signals.hpp"

#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

Horizon make_horizon(const VariantConfig& v) {
  Horizon horizon{v.timing.tick_s, {}};
  if (solver_row(v.solver).pulses) {
    horizon.blocks.assign(static_cast<std::size_t>(v.horizon.steps), 1);
    return horizon;
  }
  for (const int periods : v.horizon.blocks) horizon.blocks.push_back(periods * v.timing.ticks_per_period);
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
std::unique_ptr<Controller> make_mpc(const VariantConfig& v, const Motion& reference, Plane plane,
                                     const SolverDecorator& decorate) {
  AnySolver solver = make_solver<Model>(v);
  if (decorate) solver = decorate(std::move(solver));
  using Mpc = MpcController<Model, MotorInputs>;
  return make_shell(v, reference, plane,
                    Mpc({make_problem<Model>(v, plane), std::get<SolverPtr<Model>>(std::move(solver)), v.integral,
                         v.deadline_ms, v.latency_ticks, v.timing.ticks_per_period, actuator_description().outputs,
                         make_motor(v, make_model<PneumaticActuator>(v, plane))}));
}

}  // namespace

MotorInputs make_motor(const VariantConfig& v, const PneumaticActuator& model) {
  MotorLaw law = NoMotor{};
  if (v.motor == "pd" || v.predicts_motor()) law = PdMotor(model, v.motor_gains);
  if (v.motor == "inverse_dynamics") law = InverseDynamicsMotor(model, v.motor_gains);
  return MotorInputs(law, v.use_estimate);
}

std::unique_ptr<FallbackLadder> make_ladder(const VariantConfig& v, const Motion& reference, Plane plane,
                                            LadderSettings settings, const SolverDecorator& decorate) {
  if (settings.plausibility.channels.size() != actuator_channels)
    throw std::invalid_argument(
        fmt::format("ladder: bounds for {} channels (allowed: one for each of the actuator's {})",
                    settings.plausibility.channels.size(), actuator_channels));
  const auto model = make_model<PneumaticActuator>(v, plane);
  const ModeSet modes = valve_modes(v.valves, model.parameters());
  std::optional<MotorGains> motor;
  if (v.hybrid()) motor = v.motor_gains;
  bound_by_supply(settings.plausibility, model.parameters());
  return std::make_unique<FallbackLadder>(
      FallbackLadder::Parts{make_controller(v, reference, plane, decorate),
                            std::make_unique<ActuatorGuard>(model, modes, motor, v.timing.tick_s),
                            modes,
                            RestartableReference(reference),
                            {position_channel},
                            v.timing,
                            std::move(settings)});
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

std::unique_ptr<Controller> make_controller(const VariantConfig& v, const Motion& reference, Plane plane,
                                            const SolverDecorator& decorate) {
  if (const LawRow* law = find_row(law_rows(), v.solver)) return law->make(v, reference, plane);
  if (v.predicts_motor()) return make_mpc<PrestabilisedActuator>(v, reference, plane, decorate);
  return make_mpc<PneumaticActuator>(v, reference, plane, decorate);
}

CommandLimits make_limits(const VariantConfig& v) {
  return {valve_modes(v.valves, v.nominal), {v.nominal.motor_force_limit_n()}};
}

}  // namespace solenoid
