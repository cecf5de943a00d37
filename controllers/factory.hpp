#pragma once

#include "controllers/variant.hpp"
#include "core/actuator/prestabilised.hpp"
#include "core/mpc/solver.hpp"
#include "core/rt/controller.hpp"
#include "core/safety/limits.hpp"

#include <memory>

namespace solenoid {

/// Puts something between a controller and its solver: a recorder, a stopwatch, a slow twin.
class SolverWrapper {
 public:
  virtual ~SolverWrapper() = default;
  virtual std::unique_ptr<Solver<PneumaticActuator>> wrap(std::unique_ptr<Solver<PneumaticActuator>> solver) = 0;
  virtual std::unique_ptr<Solver<PrestabilisedActuator>> wrap(
      std::unique_ptr<Solver<PrestabilisedActuator>> solver) = 0;
};

/// The controller of a variant, tracking `reference`, with the arm in `plane`. Throws ConfigError or
/// std::invalid_argument for impossible combinations.
std::unique_ptr<Controller> make_controller(const VariantConfig& variant, const Trajectory& reference, Plane plane,
                                            SolverWrapper* wrapper = nullptr);

/// The problem a variant poses in each period, without state and reference. Model: PneumaticActuator, or
/// PrestabilisedActuator for variants with the motor in the prediction (predicts_motor()).
template <HybridModel Model>
Problem<Model> make_problem(const VariantConfig& variant, Plane plane);

/// The variant's solver, one of VariantChoices::solvers().
template <HybridModel Model>
std::unique_ptr<Solver<Model>> make_solver(const VariantConfig& variant);
/// The solver of this name with the settings of a variant that says nothing more.
template <HybridModel Model>
std::unique_ptr<Solver<Model>> make_solver(const std::string& name) {
  VariantConfig variant;
  variant.solver = name;
  return make_solver<Model>(variant);
}

/// The exit every command of this variant passes.
CommandLimits make_limits(const VariantConfig& variant);

}  // namespace solenoid
