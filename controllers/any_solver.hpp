#pragma once

#include "controllers/registered_systems.hpp"
#include "core/mpc/solver.hpp"

#include <functional>
#include <memory>
#include <variant>

namespace solenoid {

/// A row of the catalogue makes its solver as this.
template <HybridModel M>
using SolverPtr = std::unique_ptr<Solver<M>>;

/// A solver over any of the models that controllers believe.
using AnySolver = AllModels::AnyOf<SolverPtr>;
/// A problem over any of them.
using AnyProblem = AllModels::AnyOf<Problem>;

/// Puts something around a solver before a controller gets it: a thread, a recorder, a stopwatch, injected faults.
using SolverDecorator = std::function<AnySolver(AnySolver)>;

/// A decorator from wrap(std::unique_ptr<Solver<M>>), which returns a std::unique_ptr<Solver<M>> again.
template <class Wrap>
SolverDecorator decorator(Wrap wrap) {
  return [wrap](AnySolver solver) mutable {
    return std::visit([&](auto inner) { return AnySolver(wrap(std::move(inner))); }, std::move(solver));
  };
}

/// A solver that passes everything on: what decorators change, they override.
template <HybridModel M>
class SolverAround : public Solver<M> {
 public:
  explicit SolverAround(std::unique_ptr<Solver<M>> inner) : inner_(std::move(inner)) {}
  void prepare(const Problem<M>& problem) override { inner_->prepare(problem); }
  SolveReport solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept override {
    return inner_->solve(problem, plan, deadline);
  }
  bool anticipates() const override { return inner_->anticipates(); }
  void anticipate(const Problem<M>& expected, const Plan<M>& warm_start) noexcept override {
    inner_->anticipate(expected, warm_start);
  }
  bool time_phases(PhaseTimes* into) noexcept override { return inner_->time_phases(into); }

 protected:
  std::unique_ptr<Solver<M>> inner_;
};

}  // namespace solenoid
