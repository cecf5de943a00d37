#pragma once

#include "core/mpc/hybrid_model.hpp"
#include "core/mpc/mode_set.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace solenoid {

/// Blocks that a tree search takes.
inline constexpr std::size_t max_tree_blocks = 32;
/// Modes that it takes.
inline constexpr int max_tree_modes = 4096;

/// A mode a block.
using ModeSequence = std::array<std::uint16_t, max_tree_blocks>;

/// The modes of a tree's first blocks: where they lead, what they cost, and what every completion costs at least.
template <HybridModel M>
struct TreeNode {
  StateOf<M> state{};
  double cost = 0.0, bound = 0.0;
  int switches = 0;
  int source = 0;  ///< which of its level's lines it was commanded on
  ModeSequence modes{};
};

/// The open nodes whose next block is this level's, best bound first from `next` on.
template <HybridModel M>
struct TreeLevel {
  /// A node's place in the order.
  struct Rank {
    double bound;
    std::uint32_t node;
    bool operator<(const Rank& other) const {
      return bound < other.bound || (bound == other.bound && node < other.node);
    }
  };
  std::vector<TreeNode<M>> nodes;
  std::vector<Rank> order;
  std::vector<DelayLines> lines;  ///< commands in flight before the nodes' last block, one a parent; if still in flight
  bool settled = false;  ///< whether earlier commands are over as this block begins, and nothing holds a switch
  int next = 0, count = 0;

  /// The i-th best.
  const TreeNode<M>& node(int i) const { return nodes[order[static_cast<std::size_t>(i)].node]; }
};

}  // namespace solenoid
