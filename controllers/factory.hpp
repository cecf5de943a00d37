#pragma once

#include "controllers/any_solver.hpp"
#include "controllers/catalogue.hpp"
#include "controllers/controller_shell.hpp"
#include "controllers/ladder/fallback_ladder.hpp"
#include "controllers/variant.hpp"
#include "core/rt/controller.hpp"
#include "core/safety/limits.hpp"
#include "core/systems/actuator/valves.hpp"

#include <memory>

namespace solenoid {

/// The controller of a variant, tracking `reference`, with the arm in `plane`; `decorate` gets its solver, if it has
/// one, before the controller does. Throws ConfigError or std::invalid_argument for impossible combinations.
std::unique_ptr<Controller> make_controller(const VariantConfig& variant, const Motion& reference, Plane plane,
                                            const SolverDecorator& decorate = {});

/// The problem a variant poses in each period, without state and reference. Model: PneumaticActuator, or
/// PrestabilisedActuator for variants with the motor in the prediction (predicts_motor()).
template <HybridModel Model>
Problem<Model> make_problem(const VariantConfig& variant, Plane plane);

/// The variant's solver.
template <HybridModel Model>
std::unique_ptr<Solver<Model>> make_solver(const VariantConfig& variant) {
  return solver_row(variant.solver).make.of<Model>(variant);
}
/// The solver of this name with the settings of a variant that says nothing more.
template <HybridModel Model>
std::unique_ptr<Solver<Model>> make_solver(const std::string& name) {
  VariantConfig variant;
  variant.solver = name;
  return make_solver<Model>(variant);
}

/// The exit every command of this variant passes.
CommandLimits make_limits(const VariantConfig& variant);

/// What the variant believes, with the arm in this plane.
template <HybridModel Model>
Model make_model(const VariantConfig& v, Plane plane) {
  ActuatorParameters nominal = v.nominal;
  nominal.plane = plane;
  if constexpr (HasFeedback<Model>)
    return Model(nominal, v.motor_gains);
  else
    return Model(nominal);
}

/// The motor's law beside the valves, and what the variant uses of the estimate.
MotorInputs make_motor(const VariantConfig& variant, const PneumaticActuator& model);

/// A variant's controller inside the fallback ladder, as the rig runs it. Throws ConfigError or std::invalid_argument.
std::unique_ptr<FallbackLadder> make_ladder(const VariantConfig& variant, const Motion& reference, Plane plane,
                                            LadderSettings settings, const SolverDecorator& decorate = {});

/// A decider with the estimator, references and exits of its variant around it.
template <class Decider>
std::unique_ptr<Controller> make_shell(const VariantConfig& v, const Motion& reference, Plane plane, Decider decider) {
  const auto model = make_model<PneumaticActuator>(v, plane);
  typename ControllerShell<Decider>::Parts parts{RestartableReference(reference),
                                                 make_estimator(v.estimator, model, v.estimation),
                                                 valve_modes(v.valves, model.parameters()), v.timing.tick_s};
  return std::make_unique<ControllerShell<Decider>>(std::move(parts), std::move(decider));
}

}  // namespace solenoid
