#pragma once

#include "core/mpc/solver.hpp"

namespace solenoid {

/// A solver whose caller does not wait: it posts problems and asks, tick by tick, for the newest plan that is finished.
/// What is posted while a solve is under way replaces what was posted before and not yet begun.
template <HybridModel M>
class DeferredSolver : public Solver<M> {
 public:
  /// A plan that is finished, under the ticket its problem was posted with.
  struct Finished {
    std::int64_t ticket = -1;
    Plan<M> plan;
    SolveReport report;
  };

  /// Copies what changes from one problem to the next, and the warm start. No allocation, lock or exception.
  virtual void post(std::int64_t ticket, const Problem<M>& problem, const Plan<M>& warm_start,
                    double budget_s) noexcept = 0;
  /// The newest plan finished since the last call, or nullptr. Valid until the next call.
  virtual const Finished* collect() noexcept = 0;
};

/// Copies the parts of a problem that a controller changes from period to period; shapes are equal.
template <HybridModel M>
void copy_conditions(const Problem<M>& from, Problem<M>& to) noexcept {
  to.model = from.model;
  to.cost = from.cost;
  to.bounds = from.bounds;
  to.initial = from.initial;
  to.lines = from.lines;
  std::copy(from.reference.begin(), from.reference.end(), to.reference.begin());
  std::copy(from.setpoint.begin(), from.setpoint.end(), to.setpoint.begin());
}

}  // namespace solenoid
