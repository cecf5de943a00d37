#pragma once

#include "solvers/search/lane_inputs.hpp"
#include "solvers/search/rollout_kernel.hpp"
#include "solvers/search/tree_nodes.hpp"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>

namespace solenoid {

/// The cost that no state reachable from a node can avoid, for many nodes at a time, a SIMD lane each.  [theory.md, eq. 2]
template <HybridModel M>
class NodeBounds {
 public:
  /// Boxes are followed `most_steps` at most.
  NodeBounds(const RolloutKernel<M>& kernel, int most_steps) : kernel_(kernel), most_steps_(most_steps) {}

  /// Sizes everything. Allocates.
  void prepare(const LaneInputBuilder<M>& builder) {
    lowest_.reserve(builder.most_pieces());
    highest_.reserve(builder.most_pieces());
  }

  /// How many steps a node's reachable set is followed that has block b before it; 0: it gets no such bound.
  int steps(const Horizon& horizon, const SwitchTiming& timing, std::size_t b) const noexcept {
    if (kernel_.enclose == nullptr || horizon.blocks[b - 1] < timing.longest_delay) return 0;
    const auto next = horizon.blocks.begin() + static_cast<std::ptrdiff_t>(b);
    return std::min(most_steps_, std::accumulate(next, horizon.blocks.end(), 0));
  }

  /// Raises the bounds of nodes whose last command is that of block b, over a span that begins with the next. What costs
  /// more than `incumbent` does not count. Returns the steps asked for, lanes of whole registers each.
  std::int64_t raise(const Problem<M>& problem, const LaneInputBuilder<M>& builder, const RollSpan<M>& span,
                     double incumbent, std::size_t b, std::span<TreeNode<M>> nodes) noexcept {
    std::int64_t steps = 0;
    builder.begin(0, lowest_);
    builder.begin(0, highest_);
    for (std::size_t from = 0; from < nodes.size(); from += max_lanes) {
      const std::span<TreeNode<M>> some = nodes.subspan(from, std::min<std::size_t>(max_lanes, nodes.size() - from));
      boxes_.count = static_cast<int>(some.size());
      for (int lane = 0; lane < boxes_.count; ++lane) {
        const TreeNode<M>& node = some[static_cast<std::size_t>(lane)];
        for (std::size_t k = 0; k < M::state_size; ++k) boxes_.low[k][lane] = boxes_.high[k][lane] = node.state[k];
        boxes_.cost[lane] = node.cost;
        const int changes = changes_left(problem, incumbent, node);
        builder.hull(node.modes[b], changes, lane, lowest_, highest_);
      }
      pad();
      steps += std::int64_t{kernel_.whole_registers(boxes_.count)} * span.length;
      kernel_.enclose(problem, span, lowest_, highest_, boxes_);
      for (std::size_t lane = 0; lane < some.size(); ++lane)  // in this order: a box that is no number says nothing
        some[lane].bound = std::max(some[lane].cost, boxes_.cost[lane]);
    }
    return steps;
  }

 private:
  /// The switch changes after which a completion of `node` is worse than the incumbent whatever else it does.
  static int changes_left(const Problem<M>& problem, double incumbent, const TreeNode<M>& node) noexcept {
    const double left = (incumbent - node.cost) / problem.cost.switching * (1 + 1e-9);
    if (left < 0) return 0;  // worse already: only a search that leaves out nothing still has it
    return left < max_switches ? static_cast<int>(left) : static_cast<int>(max_switches);
  }

  /// Fills the unused lanes of the last register with copies of the first lane.
  void pad() noexcept {
    for (int lane = boxes_.count; lane % kernel_.width != 0; ++lane) {
      for (auto* rows : {&boxes_.low, &boxes_.high})
        for (auto& row : *rows) row[lane] = row[0];
      boxes_.cost[lane] = Bounds<M>::infinity;
      for (auto* inputs : {&lowest_, &highest_})
        for (int p = 0; p < inputs->pieces; ++p)
          for (auto& row : inputs->piece[static_cast<std::size_t>(p)].value) row[lane] = row[0];
    }
  }

  RolloutKernel<M> kernel_;
  int most_steps_;
  LaneInputs<M> lowest_, highest_;
  Boxes<M> boxes_;
};

}  // namespace solenoid
