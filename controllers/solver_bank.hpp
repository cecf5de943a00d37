#pragma once

#include "controllers/any_solver.hpp"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

namespace solenoid {

/// One solver for each of several mode sets: the problem's own, and those of what is left of it when a switch has failed. All of
/// them are prepared at once, so that changing from one to another is changing a number (AnyProblem::mode_set).
class SolverBank final : public SolverAround {
 public:
  /// A mode set and its solver; neither, where nothing is left.
  using Spare = std::pair<std::optional<ModeSet>, AnySolverPtr>;

  /// `first` is for the problem's own mode set, the k-th of the spares for AnyProblem::mode_set k + 1.
  SolverBank(AnySolverPtr first, std::vector<Spare> spares)
      : SolverAround(std::move(first)), spares_(std::move(spares)) {}

  bool time_phases(PhaseTimes* into) noexcept override {
    bool all = inner_->time_phases(into);
    for (auto& [modes, solver] : spares_) all = (!solver || solver->time_phases(into)) && all;
    return all;
  }
  bool do_most_work(bool on) noexcept override {
    bool all = inner_->do_most_work(on);
    for (auto& [modes, solver] : spares_) all = (!solver || solver->do_most_work(on)) && all;
    return all;
  }

 private:
  void do_prepare(const AnyProblem& problem) override {
    inner_->prepare(problem);
    problems_.clear();
    for (auto& [modes, solver] : spares_) {
      problems_.emplace_back(problem);
      if (!modes) continue;
      (*problems_.back()).modes = *modes;
      solver->prepare(*problems_.back());
    }
  }
  SolveReport do_solve(const AnyProblem& problem, AnyPlan& plan, Deadline deadline) noexcept override {
    if (problem.mode_set == 0) return inner_->solve(problem, plan, deadline);
    return solver_of(problem).solve(posed(problem), plan, deadline);
  }
  void do_anticipate(const AnyProblem& expected, const AnyPlan& warm_start) noexcept override {
    if (expected.mode_set == 0)
      inner_->anticipate(expected, warm_start);
    else
      solver_of(expected).anticipate(posed(expected), warm_start);
  }

  static std::size_t index(const AnyProblem& problem) noexcept {
    return static_cast<std::size_t>(problem.mode_set - 1);
  }
  AnySolver& solver_of(const AnyProblem& problem) noexcept { return *spares_[index(problem)].second; }
  /// The same conditions over the set's own modes.
  const AnyProblem& posed(const AnyProblem& problem) noexcept {
    AnyProblem& own = *problems_[index(problem)];
    own.copy_conditions(problem);
    return own;
  }

  std::vector<Spare> spares_;
  std::vector<Held<AnyProblem>> problems_;
};

}  // namespace solenoid
