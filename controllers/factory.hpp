#pragma once

#include "controllers/controller_shell.hpp"
#include "controllers/systems.hpp"

#include <memory>
#include <string>
#include <typeindex>

namespace solenoid {

/// The controller of a variant, tracking `reference`; `decorate` gets its solver, if it has one, before the controller
/// does. Throws ConfigError or std::invalid_argument for impossible combinations.
std::unique_ptr<Controller> make_controller(const VariantConfig& variant, const Motion& reference,
                                            const SolverDecorator& decorate = {});

/// The problem a variant poses in each period, without state and reference. Throws std::bad_cast if Model is not the
/// variant's.
template <HybridModel Model>
Problem<Model> make_problem(const VariantConfig& variant) {
  return dynamic_cast<Problem<Model>&>(*system_of(variant).problem(variant));
}

/// The solver of a row for a model and a variant. Throws std::invalid_argument where it is not made for the model.
AnySolverPtr make_solver(const SolverRow& row, std::type_index model, const VariantConfig& variant);
/// The variant's solver for the model that it believes; throws the same.
AnySolverPtr make_solver(const VariantConfig& variant);
/// The variant's solver for this model; throws the same.
template <HybridModel Model>
SolverPtr<Model> make_solver(const VariantConfig& variant) {
  AnySolverPtr made = make_solver(solver_row(variant), typeid(Model), variant);
  SolverPtr<Model> solver(&dynamic_cast<Solver<Model>&>(*made));
  static_cast<void>(made.release());
  return solver;
}
/// A solver made ready for a problem, or why there is none.
struct ReadySolver {
  AnySolverPtr solver;  ///< none where it cannot take the problem
  std::string misfit;   ///< why, for a sentence that begins with its name
};
/// The variant's solver, made ready for this problem.
ReadySolver ready_solver(const VariantConfig& variant, const AnyProblem& problem);

/// The solver of this name with the settings of a variant of the first system that says nothing more.
template <HybridModel Model>
SolverPtr<Model> make_solver(const std::string& name) {
  VariantConfig variant = new_variant();
  variant.solver = name;
  return make_solver<Model>(variant);
}

/// The exit every command of this variant passes.
CommandLimits make_limits(const VariantConfig& variant);

/// A variant's controller inside the fallback ladder, as the rig runs it. Throws ConfigError or std::invalid_argument.
std::unique_ptr<FallbackLadder> make_ladder(const VariantConfig& variant, const Motion& reference,
                                            LadderSettings settings, const SolverDecorator& decorate = {});

/// A decider with the estimator, references and exits of its variant around it.
template <class Decider>
std::unique_ptr<Controller> make_shell(const VariantConfig& v, const Motion& reference, Decider decider) {
  const System& system = system_of(v);
  typename ControllerShell<Decider>::Parts parts{restartable(reference, system.description()),
                                                 system.estimator(v),
                                                 system.modes(v),
                                                 v.timing.tick_s,
                                                 system.health(v),
                                                 system.spare_modes(v)};
  return std::make_unique<ControllerShell<Decider>>(std::move(parts), std::move(decider));
}

}  // namespace solenoid
