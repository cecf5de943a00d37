#pragma once

#include "core/mpc/solver.hpp"
#include "solvers/search/lane_inputs.hpp"
#include "solvers/search/rollout_kernel.hpp"
#include "solvers/search/tree_nodes.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

namespace solenoid {

/// Every sequence of modes over a problem's first blocks, level by level, a SIMD lane each; at the end of each that may
/// still be of use a function says what the blocks left cost.
template <HybridModel M>
class TailLanes {
 public:
  /// Sequences that are kept: what the blocks left cost is not known so well that the best is sure.
  static constexpr std::size_t kept = 3;

  explicit TailLanes(const RolloutKernel<M>& kernel = rollout_kernel<M>()) : kernel_(kernel) {}

  /// For the first `searched` blocks, before whose last there are at most `nodes` sequences. Allocates.
  void prepare(const Problem<M>& problem, std::size_t searched, std::size_t nodes) {
    timing_ = SwitchTiming(problem.modes, problem.horizon.dt_s);
    builder_.prepare(problem.modes, timing_);
    inputs_.reserve(builder_.most_pieces());
    planned_.resize(problem.reference.size());
    searched_ = searched;
    settled_.assign(searched + 1, 0);
    for (std::size_t b = 1; b <= searched; ++b) settled_[b] = settles(timing_, problem.horizon.blocks[b - 1]);
    for (auto* level : {&level_, &next_}) level->reserve(nodes);
    const bool follows = std::ranges::count(settled_.begin() + 1, settled_.end(), 0) > 0;
    lines_.resize(follows ? nodes : 1);
    next_lines_.resize(follows ? nodes : 1);
  }

  /// The first blocks for which their cost and rest(state, lines) sum up to the least, the best first, at most `kept`;
  /// ties as of every search. What costs more than report.cost is left out; none: all of it does. Work is added to the
  /// report. Once the deadline has passed, which is looked at whenever the lanes are full, the best of what was tried.
  /// No allocation.
  template <class Rest>
  std::span<const ModeSequence> search(const Problem<M>& problem, const Plan<M>& plan, SolveReport& report,
                                       Deadline deadline, const Rest& rest) noexcept {
    found_ = 0;
    level_.assign(1, TreeNode<M>{});
    level_.front().state = problem.initial;
    lines_.front() = problem.lines;
    int first_step = 0;
    for (std::size_t b = 0; b < searched_; first_step += problem.horizon.blocks[b++]) {
      std::fill_n(planned_.begin() + first_step, problem.horizon.blocks[b], plan.continuous[b]);
      stopped_ = !expand(problem, b, first_step, report, deadline, rest);
      if (stopped_) break;
      if (b + 1 < searched_) std::swap(level_, next_), std::swap(lines_, next_lines_);
    }
    return {best_.data(), found_};
  }
  /// Whether the deadline came before the last search's end.
  bool stopped() const noexcept { return stopped_; }

 private:
  /// What decides between leaves before their modes do: costs, then switch changes.
  using Rank = std::pair<double, int>;
  /// Where a lane comes from.
  struct Source {
    std::size_t node = 0;  ///< of the level
    int mode = 0, switches = 0;
  };

  /// Commands in flight as a node's next block begins, block b.
  DelayLines lines_of(const Problem<M>& problem, std::size_t node, std::size_t b) const noexcept {
    if (b > 0 && settled_[b] != 0) return DelayLines(problem.modes.pattern(level_[node].modes[b - 1]));
    return lines_[node];
  }

  /// False if the deadline came first.
  template <class Rest>
  bool expand(const Problem<M>& problem, std::size_t b, int first_step, SolveReport& report, Deadline deadline,
              const Rest& rest) noexcept {
    next_.clear();
    int flight = b == 0 ? problem.lines.settled_after() : 0;
    if (b > 0 && settled_[b] == 0)
      for (std::size_t n = 0; n < level_.size(); ++n) flight = std::max(flight, lines_[n].settled_after());
    start(flight);
    for (std::size_t n = 0; n < level_.size(); ++n) {
      const DelayLines before = lines_of(problem, n, b);
      for (int mode = 0; mode < problem.modes.size(); ++mode) {
        if (!before.may_command(problem.modes.pattern(mode), timing_)) continue;
        if (lanes_.count == max_lanes) {
          if (deadline.passed()) return false;
          finish(problem, b, first_step, report, rest);
          start(flight);
        }
        add(problem, n, before, mode);
      }
    }
    if (deadline.passed()) return false;
    finish(problem, b, first_step, report, rest);
    return true;
  }

  void start(int flight) noexcept {
    lanes_.count = 0;
    builder_.begin(flight, inputs_);
  }

  void add(const Problem<M>& problem, std::size_t node, const DelayLines& before, int mode) noexcept {
    const auto lane = static_cast<std::size_t>(lanes_.count++);
    const TreeNode<M>& parent = level_[node];
    const SwitchPattern pattern = problem.modes.pattern(mode);
    const int changes = std::popcount(pattern ^ before.commanded());
    for (std::size_t i = 0; i < M::state_size; ++i) lanes_.state[i][lane] = parent.state[i];
    lanes_.cost[lane] = parent.cost + problem.cost.switching * changes;
    source_[lane] = {node, mode, parent.switches + changes};
    builder_.command(before, pattern, static_cast<int>(lane), inputs_);
  }

  /// Rolls the lanes; what is of use goes to the next level, or behind the last block to the best.
  template <class Rest>
  void finish(const Problem<M>& problem, std::size_t b, int first_step, SolveReport& report,
              const Rest& rest) noexcept {
    if (lanes_.count == 0) return;
    pad_lanes(kernel_.width, inputs_, lanes_);
    const int steps = problem.horizon.blocks[b];
    kernel_.roll(problem, {planned_.data(), first_step, steps, report.cost}, inputs_, lanes_);
    report.nodes += lanes_.count;
    report.model_steps += std::int64_t{kernel_.whole_registers(lanes_.count)} * steps;
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(lanes_.count); ++lane) {
      if (!(lanes_.cost[lane] <= report.cost) || !std::isfinite(lanes_.cost[lane])) continue;
      const Source& from = source_[lane];
      TreeNode<M> child = level_[from.node];
      for (std::size_t i = 0; i < M::state_size; ++i) child.state[i] = lanes_.state[i][lane];
      child.cost = lanes_.cost[lane];
      child.switches = from.switches;
      child.modes[b] = static_cast<std::uint16_t>(from.mode);
      DelayLines after =
          settled_[b + 1] != 0 ? DelayLines(problem.modes.pattern(from.mode)) : commanded(problem, from, b);
      if (b + 1 < searched_) {
        if (settled_[b + 1] == 0) next_lines_[next_.size()] = after;
        next_.push_back(child);
      } else {
        keep_if_better(child, child.cost + rest(child.state, after));
      }
    }
  }

  DelayLines commanded(const Problem<M>& problem, const Source& from, std::size_t b) const noexcept {
    DelayLines lines = lines_of(problem, from.node, b);
    lines.command(problem.modes.pattern(from.mode), timing_);
    lines.advance(problem.horizon.blocks[b]);
    return lines;
  }

  void keep_if_better(const TreeNode<M>& leaf, double cost) noexcept {
    if (!std::isfinite(cost)) return;
    const Rank rank{cost, leaf.switches};
    std::size_t at = found_ < kept ? found_++ : kept;
    for (; at > 0 && (rank < rank_[at - 1] || (rank == rank_[at - 1] && leaf.modes < best_[at - 1])); --at)
      if (at < kept) rank_[at] = rank_[at - 1], best_[at] = best_[at - 1];
    if (at < kept) rank_[at] = rank, best_[at] = leaf.modes;
  }

  RolloutKernel<M> kernel_;
  SwitchTiming timing_;
  LaneInputBuilder<M> builder_;
  LaneInputs<M> inputs_;
  Lanes<M> lanes_;
  std::array<Source, max_lanes> source_{};
  bool stopped_ = false;
  std::size_t searched_ = 1;
  std::vector<char> settled_;  // blocks before which all earlier commands are over
  std::vector<TreeNode<M>> level_, next_;
  std::vector<DelayLines> lines_, next_lines_;  // of their nodes, where commands are in flight
  std::vector<ContinuousOf<M>> planned_;
  std::array<ModeSequence, kept> best_{};
  std::array<Rank, kept> rank_{};  // of these
  std::size_t found_ = 0;          // so many
};

}  // namespace solenoid
