#pragma once

#include "core/mpc/deadline.hpp"
#include "core/mpc/phases.hpp"
#include "core/mpc/rollout.hpp"
#include "solvers/search/lane_inputs.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <numeric>
#include <vector>

namespace solenoid {

/// How long ModeSwaps may improve a plan, and what the plan may switch.
struct ModeSwapSettings {
  int most_sweeps = 100;
  int max_switches =
      std::numeric_limits<int>::max();  ///< switch changes a plan may have, the first against the command
};

/// Local improvement of a mode sequence by its true cost: in each block every other mode, and for each change of mode
/// its move by 1, 2, 4, ... blocks either way; the best of a block is taken, sweep after sweep, until one changes
/// nothing.
///
/// Candidates that leave the plan at the same block are rolled together, one a SIMD lane. A lane equals the scalar
/// rollout to the last bit, so the result does not depend on the machine.
///
/// promise   the cost never rises; the plan that is left has no better neighbour unless stopped; no allocation after
///           prepare
/// All weights and the model's consumption must be >= 0: a candidate is dropped as soon as its cost reaches the best's.
template <HybridModel M>
class ModeSwaps {
 public:
  explicit ModeSwaps(const ModeSwapSettings& settings = {}) : settings_(settings), kernel_(rollout_kernel<M>()) {}

  void prepare(const Problem<M>& problem) {
    const std::vector<int>& blocks = problem.horizon.blocks;
    timing_ = SwitchTiming(problem.modes, problem.horizon.dt_s);
    builder_.prepare(problem.modes, timing_);
    inputs_.reserve(builder_.most_pieces());
    prefix_.assign(blocks.size() + 1, Rollout<M>());
    planned_.resize(problem.reference.size());
    first_step_.resize(blocks.size());
    std::exclusive_scan(blocks.begin(), blocks.end(), first_step_.begin(), 0);
  }

  /// Returns the report of evaluate() for the plan it leaves, with the blocks rolled out as nodes; deadline_reached if
  /// stopped before the end, iteration_limit by most_sweeps. A plan that breaks a bound, a dwell or max_switches counts
  /// as one of infinite cost.
  SolveReport improve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept {
    nodes_ = 0;
    Status end = Status::iteration_limit;
    spread_continuous(problem, plan);
    roll_prefixes(problem, plan, 0);
    cost_ = judged(problem, prefix_.back());
    for (int sweep = 0; sweep < settings_.most_sweeps && end == Status::iteration_limit; ++sweep) {
      bool changed = false;
      for (std::size_t b = 0; b < plan.modes.size() && end == Status::iteration_limit; ++b) {
        if (deadline.passed()) end = Status::deadline_reached;
        changed = improve_block(problem, plan, b) || changed;
      }
      if (!changed && end == Status::iteration_limit) end = Status::feasible;
    }
    SolveReport report = evaluate(problem, plan);
    report.nodes = nodes_;
    if (report.status == Status::feasible) report.status = end;
    return report;
  }

  void time_phases(PhaseTimes* into) noexcept { phases_ = into; }

 private:
  /// A run of blocks [from, to) set to `mode`.
  struct Move {
    std::size_t from = 0, to = 0;
    int mode = 0;
  };
  /// A move that is being rolled.
  struct Candidate {
    Move move;
    DelayLines lines;
    int switches = 0;
  };

  bool improve_block(const Problem<M>& problem, Plan<M>& plan, std::size_t b) noexcept {
    best_ = Move();
    for (int mode = 0; mode < problem.modes.size(); ++mode)
      if (mode != plan.modes[b]) add({b, b + 1, mode}, problem, plan);
    const bool begins = b > 0 && plan.modes[b] != plan.modes[b - 1];
    for (std::size_t far = 2; begins && b + far <= plan.modes.size(); far *= 2)
      add({b, b + far, plan.modes[b - 1]}, problem, plan);
    roll_candidates(problem, plan);
    for (std::size_t far = 2; begins && far <= b; far *= 2) {
      add({b - far, b, plan.modes[b]}, problem, plan);
      roll_candidates(problem, plan);
    }
    if (best_.to == 0) return false;
    std::fill(plan.modes.begin() + static_cast<std::ptrdiff_t>(best_.from),
              plan.modes.begin() + static_cast<std::ptrdiff_t>(best_.to), best_.mode);
    roll_prefixes(problem, plan, best_.from);
    return true;
  }

  void spread_continuous(const Problem<M>& problem, const Plan<M>& plan) noexcept {
    for (std::size_t b = 0; b < first_step_.size(); ++b)
      for (int i = 0; i < problem.horizon.blocks[b]; ++i)
        planned_[static_cast<std::size_t>(first_step_[b] + i)] = plan.continuous[b];
  }

  void roll_prefixes(const Problem<M>& problem, const Plan<M>& plan, std::size_t from) noexcept {
    const PhaseScope timed(phases_, Phase::rollout);
    if (from == 0) prefix_[0] = Rollout<M>(problem);
    for (std::size_t b = from; b < plan.modes.size(); ++b) {
      prefix_[b + 1] = prefix_[b];
      roll_block(problem, timing_, plan.modes[b], problem.horizon.blocks[b], plan.continuous[b], prefix_[b + 1]);
      ++nodes_;
    }
  }

  /// One more lane; the candidates of one group leave the plan at the same block.
  void add(const Move& move, const Problem<M>& problem, const Plan<M>& plan) noexcept {
    if (lanes_.count == max_lanes) roll_candidates(problem, plan);
    const Rollout<M>& before = prefix_[move.from];
    if (!before.feasible) return;
    const auto lane = static_cast<std::size_t>(lanes_.count++);
    candidates_[lane] = {move, before.lines, before.switches};
    for (std::size_t i = 0; i < M::state_size; ++i) lanes_.state[i][lane] = before.state[i];
    lanes_.cost[lane] = before.cost;
  }

  /// Rolls the group to the end, block by block, without those that cost as much as the best already; the first of the
  /// cheapest is the new best.
  void roll_candidates(const Problem<M>& problem, const Plan<M>& plan) noexcept {
    const PhaseScope timed(phases_, Phase::rollout);
    const std::size_t from = lanes_.count > 0 ? candidates_[0].move.from : plan.modes.size();
    for (std::size_t b = from; b < plan.modes.size() && lanes_.count > 0; ++b) {
      command_lanes(problem, plan, b);
      kernel_.roll(problem, {planned_.data(), first_step_[b], problem.horizon.blocks[b], cost_}, inputs_, lanes_);
      nodes_ += lanes_.count;
      drop_dear_lanes();
    }
    for (int lane = 0; lane < lanes_.count; ++lane) {
      const double cost = judged(problem, lane);
      if (cost < cost_) cost_ = cost, best_ = candidates_[static_cast<std::size_t>(lane)].move;
    }
    lanes_.count = 0;
  }

  void command_lanes(const Problem<M>& problem, const Plan<M>& plan, std::size_t b) noexcept {
    int flight = 0;
    for (int lane = 0; lane < lanes_.count; ++lane)
      flight = std::max(flight, candidates_[static_cast<std::size_t>(lane)].lines.settled_after());
    builder_.begin(flight, inputs_);
    for (int lane = 0; lane < lanes_.count; ++lane) {
      Candidate& candidate = candidates_[static_cast<std::size_t>(lane)];
      const SwitchPattern pattern = problem.modes.pattern(b < candidate.move.to ? candidate.move.mode : plan.modes[b]);
      const int changes = std::popcount(pattern ^ candidate.lines.commanded());
      candidate.switches += changes;
      lanes_.cost[lane] = candidate.lines.may_command(pattern, timing_)
                              ? lanes_.cost[lane] + problem.cost.switching * changes
                              : Bounds<M>::infinity;
      builder_.command(candidate.lines, pattern, lane, inputs_);
      candidate.lines.command(pattern, timing_);
      candidate.lines.advance(problem.horizon.blocks[b]);
    }
    for (int lane = lanes_.count; lane % kernel_.width != 0; ++lane) copy_lane(0, lane, Bounds<M>::infinity);
  }

  /// The unused lanes of the last register repeat the first.
  void copy_lane(int from, int to, double cost) noexcept {
    for (auto& row : lanes_.state) row[to] = row[from];
    lanes_.cost[to] = cost;
    for (int p = 0; p < inputs_.pieces; ++p)
      for (auto& row : inputs_.piece[static_cast<std::size_t>(p)].value) row[to] = row[from];
  }

  void drop_dear_lanes() noexcept {
    int kept = 0;
    for (int lane = 0; lane < lanes_.count; ++lane) {
      if (!(lanes_.cost[lane] < cost_)) continue;
      if (kept != lane) {
        for (auto& row : lanes_.state) row[kept] = row[lane];
        lanes_.cost[kept] = lanes_.cost[lane];
        candidates_[static_cast<std::size_t>(kept)] = candidates_[static_cast<std::size_t>(lane)];
      }
      ++kept;
    }
    lanes_.count = kept;
  }

  double judged(const Problem<M>& problem, int lane) const noexcept {
    StateOf<M> state;
    for (std::size_t i = 0; i < M::state_size; ++i) state[i] = lanes_.state[i][lane];
    return allowed(end_cost(problem, state, lanes_.cost[lane]), candidates_[static_cast<std::size_t>(lane)].switches);
  }
  double judged(const Problem<M>& problem, const Rollout<M>& r) const noexcept {
    return allowed(total_cost(problem, r), r.switches);
  }
  static double end_cost(const Problem<M>& problem, const StateOf<M>& state, double cost) noexcept {
    return rollout_detail::weighted_square<M, double>(problem.cost.terminal, problem.reference.back(),
                                                      problem.model.template output<double>(state), cost);
  }
  double allowed(double cost, int switches) const noexcept {
    return switches <= settings_.max_switches && std::isfinite(cost) ? cost : Bounds<M>::infinity;
  }

  ModeSwapSettings settings_;
  RolloutKernel<M> kernel_;
  SwitchTiming timing_;
  LaneInputBuilder<M> builder_;
  LaneInputs<M> inputs_;
  Lanes<M> lanes_{};
  std::array<Candidate, max_lanes> candidates_{};
  std::vector<ContinuousOf<M>> planned_;  // a step each
  std::vector<int> first_step_;
  std::vector<Rollout<M>> prefix_;  // prefix_[b]: before block b of the plan
  PhaseTimes* phases_ = nullptr;
  Move best_;
  double cost_ = 0.0;
  std::int64_t nodes_ = 0;
};

}  // namespace solenoid
