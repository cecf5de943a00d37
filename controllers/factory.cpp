#include "controllers/factory.hpp"

#include "controllers/mpc_controller.hpp"
#include "core/actuator/valves.hpp"
#include "solvers/search/exhaustive.hpp"

namespace solenoid {
namespace {

Horizon make_horizon(const VariantConfig& v) {
  Horizon horizon{tick_s, {}};
  for (const int periods : v.blocks) horizon.blocks.push_back(periods * ticks_per_period);
  if (horizon.blocks.empty()) horizon.blocks = {v.steps};
  return horizon;
}

Cost<PneumaticActuator> make_cost(const VariantConfig& v) {
  Cost<PneumaticActuator> cost;
  cost.tracking = {v.position_weight, v.velocity_weight};
  cost.terminal = {v.terminal_position_weight, v.terminal_velocity_weight};
  cost.switching = v.switching_weight;
  cost.consumption = v.air_weight;
  return cost;
}

MotorLaw make_motor(const VariantConfig& v, const PneumaticActuator& model) {
  if (v.motor == "pd") return PdMotor(model, v.motor_gains);
  if (v.motor == "inverse_dynamics") return InverseDynamicsMotor(model, v.motor_gains);
  return NoMotor{};
}

}  // namespace

Problem<PneumaticActuator> make_problem(const VariantConfig& v, Plane plane) {
  ActuatorParameters believed = v.believed;
  believed.plane = plane;
  return {PneumaticActuator(believed), valve_modes(v.valves, believed), make_horizon(v), make_cost(v)};
}

std::unique_ptr<Solver<PneumaticActuator>> make_solver(const std::string&) {
  return std::make_unique<Exhaustive<PneumaticActuator>>();
}

std::unique_ptr<Controller> make_controller(const VariantConfig& v, const Trajectory& reference, Plane plane) {
  using Mpc = MpcController<PneumaticActuator>;
  Problem<PneumaticActuator> problem = make_problem(v, plane);
  MotorLaw motor = make_motor(v, problem.model);
  Estimator estimator(v.estimator, problem.model, v.estimation);
  return std::make_unique<Mpc>(Mpc::Parts{std::move(problem), make_solver(v.solver), reference, v.integral, motor,
                                          v.deadline_ms, std::move(estimator), v.use_estimate, v.latency_ticks});
}

CommandLimits make_limits(const VariantConfig& v) {
  return {valve_modes(v.valves, v.believed), v.believed.motor_force_limit_n()};
}

}  // namespace solenoid
