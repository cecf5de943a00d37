#pragma once

#include "core/mpc/plan.hpp"

#include <vector>

namespace solenoid {

/// A tree search in lanes, as the counting below sees it.
/// shapes   block_steps, bound_steps: levels, which are the blocks
struct TreeShape {
  int register_width = 1;             ///< lanes of a register; it divides `lanes`
  int lanes = 1;                      ///< that are rolled together: parents are grouped as long as their children fit
  int first_lanes = 1;                ///< the same in the first dive, the first group of each level
  int incumbents = 0;                 ///< sequences that are rolled before the tree
  std::vector<int> block_steps = {};  ///< model steps of a level's block
  /// Steps of bound that a node of the level can cost, but for level 0; empty: there is none.
  std::vector<int> bound_steps = {};
};

/// The most work of such a search over the sequences of a mode set, saturated at the largest number there is.
///
/// Counted are lanes, filled up to whole registers, times steps. What makes it a bound:
///
///     A node is expanded at most once, and its children are at most the modes that groups of switches of which one may
///     change at a time allow after its own. Dwell, bounds, pruning, an early stop and a deadline only leave out.
///     A group of parents is closed when the children of the next do not fit. So of m modes and L lanes every group of a
///     list but its last has at least floor(L/m) parents, or one, and a list that a group leaves is no longer than the
///     group has lanes. The worst of all such groupings, lists being those of one group's children, is found from the
///     leaves upwards: most(list) = max over its first group of (group + most(rest)). The first dive has one group a level,
///     of fewer lanes: its lists are counted so for their first group alone.
///     Or the other way, sharper where few modes follow each other: lanes that a group of parents wastes are at most
///     those that its parents, each alone, would waste. The sum over all ways through the tree is found the same way.
///
/// The less of the two bounds holds, for each kind of work by itself. Branch and bound that may leave out nothing does
/// exactly that much where every mode may follow every other.
MostWork most_tree_work(const ModeSet& modes, const TreeShape& shape);

}  // namespace solenoid
