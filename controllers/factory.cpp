#include "controllers/factory.hpp"

#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace solenoid {

std::unique_ptr<Controller> make_controller(const VariantConfig& v, const Motion& reference,
                                            const SolverDecorator& decorate) {
  if (const LawRow* law = find_row(system_of(v).laws(), v.solver)) return law->make(v, reference);
  return system_of(v).mpc(v, reference, decorate);
}

AnySolverPtr make_solver(const SolverRow& row, std::type_index model, const VariantConfig& variant) {
  if (AnySolverPtr made = row.make.make(model, variant)) return made;
  throw std::invalid_argument(fmt::format("the solver '{}' is not made for this model", row.name));
}

AnySolverPtr make_solver(const VariantConfig& variant) {
  return make_solver(solver_row(variant), system_of(variant).problem(variant)->model_type(), variant);
}

ReadySolver ready_solver(const VariantConfig& variant, const AnyProblem& problem) {
  try {
    AnySolverPtr solver = make_solver(solver_row(variant), problem.model_type(), variant);
    solver->prepare(problem);
    return {std::move(solver), {}};
  } catch (const std::invalid_argument& wrong) {
    return {nullptr, wrong.what()};
  }
}

std::unique_ptr<FallbackLadder> make_ladder(const VariantConfig& v, const Motion& reference, LadderSettings settings,
                                            const SolverDecorator& decorate) {
  const System& system = system_of(v);
  require_complete(settings, system.description());
  std::vector<std::size_t> axis_channels;
  for (const Axis& axis : system.description().axes) axis_channels.push_back(axis.channel);
  return std::make_unique<FallbackLadder>(FallbackLadder::Parts{
      make_controller(v, reference, decorate), system.guard(v), system.modes(v),
      restartable(reference, system.description()), axis_channels, v.timing, std::move(settings)});
}

CommandLimits make_limits(const VariantConfig& v) { return {system_of(v).modes(v), system_of(v).continuous_limits(v)}; }

}  // namespace solenoid
