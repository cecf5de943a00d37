#pragma once

#include "controllers/any_solver.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace solenoid {

/// A solve as it was posed.
struct PosedInstance {
  std::int64_t solve = 0;    ///< which of the solver's solves, from 0
  Held<AnyProblem> problem;  ///< as it was asked
  Held<AnyPlan> warm_start;
};

/// Keeps copies of what a solver is asked: every `every`th solve, at most `capacity` of them, in storage sized by
/// prepare.
class RecordingSolver final : public SolverAround {
 public:
  RecordingSolver(AnySolverPtr inner, std::vector<PosedInstance>& into, std::size_t capacity, std::int64_t every = 1)
      : SolverAround(std::move(inner)), into_(into), capacity_(capacity), every_(every) {}

  /// Instances kept since prepare: the first of the storage.
  std::size_t kept() const { return used_; }

 private:
  void do_prepare(const AnyProblem& problem) override {
    inner_->prepare(problem);
    into_.assign(capacity_, {0, Held(problem), Held(problem.new_plan())});
    used_ = 0;
    solves_ = 0;
  }
  SolveReport do_solve(const AnyProblem& problem, AnyPlan& plan, Deadline deadline) noexcept override {
    // What is left of a mode set has numbers of its own for modes, which the kept problem would not know.
    if (solves_ % every_ == 0 && used_ < into_.size() && problem.mode_set == 0) {
      PosedInstance& copy = into_[used_++];
      copy.solve = solves_;
      copy.problem->copy_conditions(problem);
      copy.warm_start->assign(plan);
    }
    ++solves_;
    return inner_->solve(problem, plan, deadline);
  }

  std::vector<PosedInstance>& into_;
  std::size_t capacity_, used_ = 0;
  std::int64_t every_, solves_ = 0;
};

}  // namespace solenoid
