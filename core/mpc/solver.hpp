#pragma once

#include "core/mpc/deadline.hpp"
#include "core/mpc/phases.hpp"
#include "core/mpc/plan.hpp"

namespace solenoid {

/// Solves one Problem after another of the same shape.
template <HybridModel M>
class Solver {
 public:
  virtual ~Solver() = default;

  /// Sizes everything for problems with this model type, mode set and horizon. May allocate and throw.
  virtual void prepare(const Problem<M>& problem) = 0;

  /// Improves on `plan`, which comes in as the warm start and leaves as the best plan found, by the deadline.
  /// No allocation, lock or exception.
  virtual SolveReport solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept = 0;

  /// Whether anticipate() shortens the next solve.
  virtual bool anticipates() const { return false; }
  /// Prepares for a problem that is still to be measured: `expected` as it is forecast, and its warm start. The next
  /// solve of a problem that differs from it in the measured state alone may use what was prepared, and then says so
  /// (SolveReport::anticipated); its plan may differ from what solve() alone finds. No allocation, lock or exception.
  virtual void anticipate(const Problem<M>& /*expected*/, const Plan<M>& /*warm_start*/) noexcept {}

  /// From now on every solve adds its parts to `into`; null switches that off, which leaves one test of a pointer a
  /// phase. Returns whether the solver can tell.
  virtual bool time_phases(PhaseTimes* /*into*/) noexcept { return false; }
};

}  // namespace solenoid
