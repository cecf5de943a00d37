#pragma once

#include "core/mpc/problem.hpp"
#include "solvers/search/tree_nodes.hpp"

#include <span>

namespace solenoid {

/// Proposes sequences of modes for a problem, which a solver then judges: nothing is believed of a proposal.
template <HybridModel M>
class Proposer {
 public:
  virtual ~Proposer() = default;
  /// For problems of this shape. May allocate; throws std::invalid_argument, saying what does not fit.
  virtual void prepare(const Problem<M>& problem) = 0;
  /// Writes the most promising first, each another one; returns how many, at most as many as there is room for. They
  /// may break dwells and other limits. No allocation, lock or exception.
  virtual int propose(const Problem<M>& problem, std::span<ModeSequence> into) noexcept = 0;
};

}  // namespace solenoid
