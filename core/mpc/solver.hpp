#pragma once

#include "core/mpc/deadline.hpp"
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
  virtual Report solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept = 0;

  /// Whether the executive may call solve in a 5 ms cycle.
  virtual bool real_time() const { return true; }
};

}  // namespace solenoid
