#pragma once

#include "core/mpc/solver.hpp"

namespace solenoid {

/// A solver whose caller does not wait: it posts problems and asks, tick by tick, for the newest plan that is finished.
/// What is posted while a solve is under way replaces what was posted before and not yet begun.
class DeferredSolver : public AnySolver {
 public:
  /// A plan that is finished, under the ticket its problem was posted with.
  struct Finished {
    std::int64_t ticket = -1;
    Held<AnyPlan> plan;
    SolveReport report;
  };

  /// Copies what changes from one problem to the next, and the warm start. No allocation, lock or exception.
  virtual void post(std::int64_t ticket, const AnyProblem& problem, const AnyPlan& warm_start,
                    double budget_s) noexcept = 0;
  /// The newest plan finished since the last call, or nullptr. Valid until the next call.
  virtual const Finished* collect() noexcept = 0;
};

}  // namespace solenoid
