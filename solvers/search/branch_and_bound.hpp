#pragma once

#include "core/mpc/phases.hpp"
#include "core/mpc/solver.hpp"
#include "solvers/search/leaf_modes.hpp"
#include "solvers/search/node_bounds.hpp"
#include "solvers/search/proposer.hpp"
#include "solvers/search/switch_changes.hpp"
#include "solvers/search/tree_work.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace solenoid {

/// How BranchAndBound searches; no setting changes the optimum.
struct TreeSearchSettings {
  bool prune = true;           ///< false: enumerate every sequence
  int enclosure_steps = 1000;  ///< the most that reachable sets are followed for the bound; 0: cost so far only
};

/// Exact search over mode sequences, depth first, a SIMD lane a candidate.
///
/// minimise  problem.hpp over mode[b], b < blocks, with the plan's continuous inputs as given        [theory.md, eq. 1]
/// bound     cost so far + the tracking and terminal cost that no state reachable from the node can avoid   [eq. 2]
/// ties      fewest switch changes, then the sequence of lowest mode numbers: the plan of Exhaustive to the last bit
/// promise   report.bound <= optimum <= report.cost at every status, and cost <= that of holding the current mode;
///           no allocation, lock or exception in solve
///
/// All weights must be >= 0 and the model's consumption too: then the cost never falls along a sequence.
template <HybridModel M>
class BranchAndBound final : public Solver<M> {
 public:
  /// What `proposer`, if there is one, thinks best is one more incumbent to start from.
  explicit BranchAndBound(const TreeSearchSettings& settings = {}, const RolloutKernel<M>& kernel = rollout_kernel<M>(),
                          std::unique_ptr<Proposer<M>> proposer = nullptr)
      : settings_(settings),
        kernel_(kernel),
        proposer_(std::move(proposer)),
        bounds_(kernel, settings.enclosure_steps) {}

  void prepare(const Problem<M>& problem) override {
    const std::size_t blocks = problem.horizon.blocks.size();
    if (blocks > max_tree_blocks) throw std::invalid_argument("branch and bound takes at most 32 blocks");
    if (problem.modes.size() > max_tree_modes)
      throw std::invalid_argument(fmt::format("branch and bound takes at most {} modes; mode set '{}' has {}",
                                              max_tree_modes, problem.modes.name(), problem.modes.size()));
    timing_ = SwitchTiming(problem.modes, problem.horizon.dt_s);
    builder_.prepare(problem.modes, timing_);
    inputs_.reserve(builder_.most_pieces());
    bounds_.prepare(builder_);
    incumbents_.resize(max_lanes);
    levels_.assign(blocks, Level());
    for (Level& level : levels_)
      level.nodes.resize(static_cast<std::size_t>(std::max(max_lanes, problem.modes.size())));
    for (Level& level : levels_) level.order.resize(level.nodes.size());
    for (Level& level : levels_) level.lines.resize(max_lanes);
    planned_.resize(problem.reference.size());
    first_step_.resize(blocks);
    std::exclusive_scan(problem.horizon.blocks.begin(), problem.horizon.blocks.end(), first_step_.begin(), 0);
    changes_.prepare(problem.modes);
    leaf_modes_.prepare(problem.modes, timing_);
    if (proposer_) proposer_->prepare(problem);
    prepare_settled(problem);
  }

  SolveReport solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept override {
    const auto start = Deadline::Clock::now();
    begin(problem, plan);
    if (settings_.prune) adopt_incumbents(problem, plan, deadline);
    open_root(problem);
    bool complete = true;
    while (complete && select_group(problem)) {
      complete = !deadline.passed();
      if (complete) expand(problem, deadline);
    }
    if (!complete && !settings_.prune)
      adopt_incumbents(problem, plan, deadline);  // what was tried may be worse than holding
    conclude(plan, complete);
    report_.time_us = us_since(start);
    return report_;
  }

  bool time_phases(PhaseTimes* into) noexcept override {
    phases_ = into;
    return true;
  }

  /// As most_tree_work() counts; enumeration finds no bounds.
  std::optional<MostWork> most_work(const AnyProblem& shape) const override {
    const std::vector<int>& blocks = shape.horizon.blocks;
    if (blocks.size() > max_tree_blocks) return std::nullopt;
    TreeShape tree{.register_width = kernel_.width,
                   .lanes = max_lanes,
                   .first_lanes = first_dive,
                   .incumbents = settings_.prune ? with_proposal(most_incumbents(shape.modes)) : 0,
                   .block_steps = blocks,
                   .bound_steps = std::vector<int>(blocks.size())};
    const SwitchTiming timing(shape.modes, shape.horizon.dt_s);
    for (std::size_t b = 1; b < blocks.size() && settings_.prune; ++b)
      tree.bound_steps[b] = bounds_.steps(shape.horizon, timing, b);
    MostWork most = most_tree_work(shape.modes, tree);
    if (!settings_.prune) {  // see solve(): once the time is over
      most.late.nodes += least_incumbents * static_cast<std::int64_t>(blocks.size());
      most.late.model_steps += std::int64_t{kernel_.whole_registers(least_incumbents)} * shape.horizon.steps();
    }
    return most;
  }
  bool do_most_work(bool on) noexcept override {
    leaves_out_ = !on;
    return true;
  }

 private:
  using Node = TreeNode<M>;
  using Level = TreeLevel<M>;

  static constexpr int first_dive = max_lanes / 2;  // lanes of a group until the first dive ends

  /// A node to be expanded.
  struct Parent {
    const Node* node = nullptr;
    const DelayLines* lines = nullptr;  // the commands in flight as its next block begins
    std::size_t before = 0;             // its row of changes_
    int changes = 0;                    // that its children may make
  };

  void prepare_settled(const Problem<M>& problem) {
    settled_lines_.clear();
    for (int mode = 0; mode < problem.modes.size(); ++mode) settled_lines_.emplace_back(problem.modes.pattern(mode));
    for (std::size_t b = 1; b < levels_.size(); ++b)
      levels_[b].settled = settles(timing_, problem.horizon.blocks[b - 1]);
  }

  void begin(const Problem<M>& problem, const Plan<M>& plan) noexcept {
    report_ = SolveReport{};
    best_modes_ = {};
    numerical_failure_ = false;
    hold_ = problem.modes.find(problem.lines.commanded());
    group_ = first_dive;
    changes_.start_from(problem.modes, problem.lines.commanded());
    for (Level& level : levels_) level.next = level.count = 0;
    for (std::size_t b = 0; b < levels_.size(); ++b)
      for (int i = 0; i < problem.horizon.blocks[b]; ++i)
        planned_[static_cast<std::size_t>(first_step_[b] + i)] = plan.continuous[b];
  }

  static constexpr double pressing_s = 0.01;  // with more time than this the first dive comes to its end
  static constexpr int least_incumbents = 2;
  static int most_incumbents(const ModeSet& modes) noexcept { return std::min(2 + 2 * modes.size(), max_lanes); }

  /// So many incumbents and, if there is a proposer, its own, in the last's place where there is no room.
  int with_proposal(int incumbents) const noexcept {
    return proposer_ ? std::min(incumbents + 1, max_lanes) : incumbents;
  }

  int incumbent_mode(const Problem<M>& problem, const Plan<M>& plan, int incumbent, std::size_t b) const noexcept {
    const int modes = problem.modes.size(), warm = std::clamp(plan.modes[b], 0, modes - 1);
    if (incumbent == proposed_) return proposal_[b];
    if (incumbent == 0) return warm;
    if (incumbent == 1) return hold_ >= 0 ? hold_ : warm;
    const int held = std::min(modes, max_lanes - least_incumbents);  // of more modes some, evenly
    if (incumbent < 2 + held) return (incumbent - 2) * modes / held;
    return b == 0 ? incumbent - 2 - held : warm;
  }

  /// Incumbents to start from: the warm start, and holding the command in force. Under a near deadline the first dive
  /// may come too late: then also, if it has not passed, holding each mode, and each mode before the rest of the warm
  /// start, as many as there are lanes. Behind them what the proposer thinks best.
  void adopt_incumbents(const Problem<M>& problem, const Plan<M>& plan, Deadline deadline) noexcept {
    const double left_s = deadline.seconds_left();
    const bool pressed = left_s > 0 && left_s < pressing_s;
    int candidates = settings_.prune && (pressed || !leaves_out_) ? most_incumbents(problem.modes) : least_incumbents;
    proposed_ = -1;
    if (settings_.prune && proposer_ && proposer_->propose(problem, std::span(&proposal_, 1)) > 0) {
      candidates = with_proposal(candidates);
      proposed_ = candidates - 1;
    }
    for (int i = 0; i < candidates; ++i) {
      incumbents_[static_cast<std::size_t>(i)] = Node{};
      incumbents_[static_cast<std::size_t>(i)].state = problem.initial;
      lines_[static_cast<std::size_t>(i)] = problem.lines;
    }
    for (std::size_t b = 0; b < levels_.size(); ++b) {
      int flight = 0;
      for (int i = 0; i < candidates; ++i)
        flight = std::max(flight, lines_[static_cast<std::size_t>(i)].settled_after());
      start_lanes(flight);
      for (int i = 0; i < candidates; ++i) {
        DelayLines& lines = lines_[static_cast<std::size_t>(i)];
        const int mode = incumbent_mode(problem, plan, i, b);
        const SwitchPattern pattern = problem.modes.pattern(mode);
        add_lane(problem, incumbents_[static_cast<std::size_t>(i)], lines, mode,
                 std::popcount(pattern ^ lines.commanded()), lines.may_command(pattern, timing_));
        lines.command(pattern, timing_);
        lines.advance(problem.horizon.blocks[b]);
      }
      roll(problem, b);
      for (int i = 0; i < candidates; ++i) incumbents_[static_cast<std::size_t>(i)] = child_of_lane(b, i);
    }
    for (int i = 0; i < candidates; ++i) keep_if_better(problem, incumbents_[static_cast<std::size_t>(i)]);
  }

  void open_root(const Problem<M>& problem) noexcept {
    Level& top = levels_.front();
    top.nodes[0] = Node{};
    top.nodes[0].state = problem.initial;
    top.order[0] = {0.0, 0};
    top.count = 1;
    depth_ = 0;
  }

  /// Takes the best open nodes of the deepest level that has any, as many as have their children fit into the lanes,
  /// into parents_; false when the tree is done.
  bool select_group(const Problem<M>& problem) noexcept {
    parent_count_ = 0;
    for (;; --depth_, group_ = max_lanes) {
      Level& level = levels_[depth_];
      int room = group_;
      for (; level.next < level.count; ++level.next) {
        const Node& node = level.node(level.next);
        if (fathomed(node)) continue;
        const std::size_t before = row_of(node);
        const int changes = changes_allowed(problem, node);
        if (changes < 0) continue;
        const int children = changes_.modes_within(before, changes);
        if (children > room && parent_count_ > 0) break;
        if (children > 0) parents_[static_cast<std::size_t>(parent_count_++)] = {&node, nullptr, before, changes};
        room -= children;
      }
      if (parent_count_ > 0) return true;
      if (depth_ == 0) return false;
    }
  }

  /// The row of changes_ of the command in force when a node of the present depth begins its next block.
  std::size_t row_of(const Node& node) const noexcept {
    return depth_ == 0 ? changes_.start_row() : node.modes[depth_ - 1];
  }

  /// The most switch changes with which a child can still be as good as the incumbent, -1 for none: the node's bound
  /// says nothing of switching to come. The margin covers the rounding of sums in another order.
  int changes_allowed(const Problem<M>& problem, const Node& node) const noexcept {
    int changes = timing_.switches;
    if (prunes())
      while (changes >= 0 && (node.bound + problem.cost.switching * changes) * (1 - 1e-12) > report_.cost) --changes;
    return changes;
  }

  bool in_first_dive() const noexcept { return group_ < max_lanes; }
  bool prunes() const noexcept { return settings_.prune && leaves_out_; }

  /// Rolls every child of the selected parents; their bounds are raised if there is time.
  void expand(const Problem<M>& problem, Deadline deadline) noexcept {
    const std::size_t b = depth_;
    const bool leaf = b + 1 == levels_.size();
    if (!leaf) levels_[b + 1].next = levels_[b + 1].count = 0;
    const int flight = follow_lines(problem, b);
    start_lanes(flight);
    const bool without_twins = leaf && levels_[b].settled && prunes();
    const auto add_child = [&](int g, int mode) {
      const Parent& parent = parents_[static_cast<std::size_t>(g)];
      if (without_twins && leaf_modes_.dominated(parent.before, mode)) return;
      const int changes = changes_.between(parent.before, mode);
      if (changes > parent.changes || !parent.lines->may_command(problem.modes.pattern(mode), timing_)) return;
      if (lanes_.count == max_lanes) finish_lanes(problem, b, leaf), start_lanes(flight);
      lane_source_[static_cast<std::size_t>(lanes_.count)] = g;
      add_lane(problem, *parent.node, *parent.lines, mode, changes, true);
    };
    // Last blocks by mode: lanes of a register then pass the cutoff at about the same step.
    if (leaf)
      for (int mode = 0; mode < problem.modes.size(); ++mode)
        for (int g = 0; g < parent_count_; ++g) add_child(g, mode);
    else
      for (int g = 0; g < parent_count_; ++g)
        for (int mode = 0; mode < problem.modes.size(); ++mode) add_child(g, mode);
    finish_lanes(problem, b, leaf);
    if (leaf) {
      group_ = max_lanes;
      return;
    }
    if (settings_.prune && !deadline.passed()) raise_bounds(problem, b + 1);
    sort(levels_[b + 1]);
    ++depth_;
  }

  /// Finds the commands in flight where the parents' next block begins; returns the steps until the last is over.
  int follow_lines(const Problem<M>& problem, std::size_t b) noexcept {
    const Level& level = levels_[b];
    int flight = 0;
    for (int g = 0; g < parent_count_; ++g) {
      const auto i = static_cast<std::size_t>(g);
      Parent& parent = parents_[i];
      if (level.settled) {
        parent.lines = &settled_lines_[parent.before];
        continue;
      }
      lines_[i] = b == 0 ? problem.lines : level.lines[static_cast<std::size_t>(parent.node->source)];
      if (b > 0) {
        lines_[i].command(problem.modes.pattern(parent.node->modes[b - 1]), timing_);
        lines_[i].advance(problem.horizon.blocks[b - 1]);
      }
      parent.lines = &lines_[i];
      flight = std::max(flight, lines_[i].settled_after());
    }
    if (b + 1 < levels_.size() && !levels_[b + 1].settled)
      for (int g = 0; g < parent_count_; ++g)
        levels_[b + 1].lines[static_cast<std::size_t>(g)] = *parents_[static_cast<std::size_t>(g)].lines;
    return flight;
  }

  void start_lanes(int flight) noexcept {
    lanes_.count = 0;
    builder_.begin(flight, inputs_);
  }

  /// A lane for the child of `parent` that commands `mode` after so many changes; out of the question unless `allowed`.
  void add_lane(const Problem<M>& problem, const Node& parent, const DelayLines& lines, int mode, int changes,
                bool allowed) noexcept {
    const auto lane = static_cast<std::size_t>(lanes_.count);
    for (std::size_t i = 0; i < M::state_size; ++i) lanes_.state[i][lane] = parent.state[i];
    lanes_.cost[lane] = allowed ? parent.cost + problem.cost.switching * changes : Bounds<M>::infinity;
    lane_parent_[lane] = &parent;
    lane_mode_[lane] = mode;
    lane_switches_[lane] = parent.switches + changes;
    builder_.command(lines, problem.modes.pattern(mode), lanes_.count, inputs_);
    ++lanes_.count;
  }

  void roll(const Problem<M>& problem, std::size_t b) noexcept {
    report_.nodes += lanes_.count;
    pad_lanes(kernel_.width, inputs_, lanes_);
    const PhaseScope timed(phases_, Phase::rollout);
    const double cutoff = prunes() ? report_.cost : Bounds<M>::infinity;
    report_.model_steps += std::int64_t{kernel_.whole_registers(lanes_.count)} * problem.horizon.blocks[b];
    kernel_.roll(problem, {planned_.data(), first_step_[b], problem.horizon.blocks[b], cutoff}, inputs_, lanes_);
  }

  Node child_of_lane(std::size_t b, int lane) const noexcept {
    const auto i = static_cast<std::size_t>(lane);
    Node child;
    for (std::size_t k = 0; k < M::state_size; ++k) child.state[k] = lanes_.state[k][i];
    child.cost = child.bound = lanes_.cost[i];
    child.switches = lane_switches_[i];
    child.source = lane_source_[i];
    child.modes = lane_parent_[i]->modes;
    child.modes[b] = static_cast<std::uint16_t>(lane_mode_[i]);
    return child;
  }

  void finish_lanes(const Problem<M>& problem, std::size_t b, bool leaf) noexcept {
    if (lanes_.count == 0) return;
    roll(problem, b);
    for (int lane = 0; lane < lanes_.count; ++lane) {
      const double cost = lanes_.cost[lane];
      numerical_failure_ = numerical_failure_ || std::isnan(cost);
      if (!std::isfinite(cost) || (prunes() && cost > report_.cost)) continue;
      if (leaf)
        keep_if_better(problem, child_of_lane(b, lane));
      else
        levels_[b + 1].nodes[static_cast<std::size_t>(levels_[b + 1].count++)] = child_of_lane(b, lane);
    }
  }

  /// Adds to the bounds of level b's nodes the cost that no state reachable from them can avoid.
  void raise_bounds(const Problem<M>& problem, std::size_t b) noexcept {
    const int length = bounds_.steps(problem.horizon, timing_, b);
    if (length == 0) return;
    const PhaseScope timed(phases_, Phase::bound);
    const RollSpan<M> span{planned_.data(), first_step_[b], length, prunes() ? report_.cost : Bounds<M>::infinity,
                           in_first_dive()};
    report_.bound_steps += bounds_.raise(problem, builder_, span, report_.cost, b - 1,
                                         std::span(levels_[b].nodes).first(static_cast<std::size_t>(levels_[b].count)));
  }

  /// Drops what the bounds have closed and sorts the rest.
  void sort(Level& level) noexcept {
    std::size_t open = 0;
    for (int i = 0; i < level.count; ++i) {
      const auto node = static_cast<std::uint32_t>(i);
      const double bound = level.nodes[node].bound;
      if (!prunes() || bound <= report_.cost) level.order[open++] = {bound, node};
    }
    level.count = static_cast<int>(open);
    std::sort(level.order.begin(), level.order.begin() + level.count);
  }

  /// Whether nothing below `node` can replace the incumbent, ties included.
  bool fathomed(const Node& node) const noexcept {
    if (!prunes() || node.bound < report_.cost) return false;
    if (node.bound > report_.cost || node.switches > report_.switches) return true;
    if (node.switches < report_.switches) return false;
    return std::lexicographical_compare(best_modes_.begin(), best_modes_.begin() + static_cast<std::ptrdiff_t>(depth_),
                                        node.modes.begin(), node.modes.begin() + static_cast<std::ptrdiff_t>(depth_));
  }

  void keep_if_better(const Problem<M>& problem, const Node& leaf) noexcept {
    const double cost = rollout_detail::weighted_square<M, double>(
        problem.cost.terminal, problem.reference.back(), problem.model.template output<double>(leaf.state), leaf.cost);
    numerical_failure_ = numerical_failure_ || std::isnan(cost);
    if (!std::isfinite(cost) || cost > report_.cost) return;
    if (cost == report_.cost) {
      if (leaf.switches > report_.switches) return;
      if (leaf.switches == report_.switches && !(leaf.modes < best_modes_)) return;
    }
    report_.cost = cost;
    report_.switches = leaf.switches;
    best_modes_ = leaf.modes;
  }

  void conclude(Plan<M>& plan, bool complete) noexcept {
    const bool found = std::isfinite(report_.cost);
    for (std::size_t b = 0; b < levels_.size(); ++b) plan.modes[b] = found ? best_modes_[b] : std::max(0, hold_);
    report_.bound = complete ? report_.cost : open_bound();
    if (found)
      report_.status = complete ? Status::optimal : Status::deadline_reached;
    else if (!complete)
      report_.status = Status::deadline_reached;
    else
      report_.status = numerical_failure_ ? Status::numerical_failure : Status::infeasible;
  }

  /// The least bound of what is still open, parents selected but not expanded included; at most the incumbent's cost.
  double open_bound() const noexcept {
    double bound = report_.cost;
    for (std::size_t d = 0; d <= depth_; ++d)
      for (int i = levels_[d].next; i < levels_[d].count; ++i) bound = std::min(bound, levels_[d].node(i).bound);
    for (int g = 0; g < parent_count_; ++g) bound = std::min(bound, parents_[static_cast<std::size_t>(g)].node->bound);
    return bound;
  }

  TreeSearchSettings settings_;
  bool leaves_out_ = true;  // what pruning may; see do_most_work()
  PhaseTimes* phases_ = nullptr;
  RolloutKernel<M> kernel_;
  std::unique_ptr<Proposer<M>> proposer_;
  ModeSequence proposal_{};
  int proposed_ = -1;  // which of the incumbents it is
  SwitchTiming timing_;
  LaneInputBuilder<M> builder_;
  LaneInputs<M> inputs_;
  Lanes<M> lanes_;
  NodeBounds<M> bounds_;
  std::array<const Node*, max_lanes> lane_parent_{};
  std::array<int, max_lanes> lane_mode_{}, lane_switches_{}, lane_source_{};
  std::array<Parent, max_lanes> parents_{};
  std::array<DelayLines, max_lanes> lines_;  // of parents where commands are in flight
  std::vector<DelayLines> settled_lines_;    // of a mode
  SwitchChanges changes_;
  LeafModes leaf_modes_;
  std::vector<Node> incumbents_;  // under way
  std::vector<Level> levels_;
  std::vector<ContinuousOf<M>> planned_;
  std::vector<int> first_step_;
  ModeSequence best_modes_{};
  std::size_t depth_ = 0;
  int parent_count_ = 0, group_ = max_lanes;
  bool numerical_failure_ = false;
  int hold_ = -1;  // the mode in force, if it is one
  SolveReport report_;
};

}  // namespace solenoid
