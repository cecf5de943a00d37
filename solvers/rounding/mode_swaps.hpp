#pragma once

#include "core/mpc/deadline.hpp"
#include "core/mpc/rollout.hpp"

#include <algorithm>
#include <limits>
#include <vector>

namespace solenoid {

struct ModeSwapSettings {
  int most_sweeps = 100;
  int max_switches =
      std::numeric_limits<int>::max();  ///< switch changes a plan may have, the first against the command
};

/// Local improvement of a mode sequence by its true cost: in each block every other mode, and for each change of mode
/// its move by 1, 2, 4, ... blocks either way; the best of a block is taken, sweep after sweep, until one changes
/// nothing.
///
/// promise   the cost never rises; the plan that is left has no better neighbour unless stopped; no allocation after
///           prepare
/// All weights and the model's consumption must be >= 0: a candidate is dropped as soon as its cost reaches the best's.
template <HybridModel M>
class ModeSwaps {
 public:
  explicit ModeSwaps(const ModeSwapSettings& settings = {}) : settings_(settings) {}

  void prepare(const Problem<M>& problem) {
    timing_ = SwitchTiming(problem.modes, problem.horizon.dt_s);
    prefix_.assign(problem.horizon.blocks.size() + 1, Rollout<M>());
  }

  /// Returns the report of evaluate() for the plan it leaves, with the blocks rolled out as nodes; deadline_reached if
  /// stopped before the end, iteration_limit by most_sweeps. A plan that breaks a bound, a dwell or max_switches counts
  /// as one of infinite cost.
  Report improve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept {
    nodes_ = 0;
    Status end = Status::iteration_limit;
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
    Report report = evaluate(problem, plan);
    report.nodes = nodes_;
    if (report.status == Status::feasible) report.status = end;
    return report;
  }

 private:
  /// A run of blocks [from, to) set to `mode`.
  struct Move {
    std::size_t from = 0, to = 0;
    int mode = 0;
  };

  bool improve_block(const Problem<M>& problem, Plan<M>& plan, std::size_t b) noexcept {
    Move best;
    const auto try_move = [&](const Move& move) {
      const double cost = cost_with(problem, plan, move);
      if (cost < cost_) cost_ = cost, best = move;
    };
    for (int mode = 0; mode < problem.modes.size(); ++mode)
      if (mode != plan.modes[b]) try_move({b, b + 1, mode});
    if (b > 0 && plan.modes[b] != plan.modes[b - 1]) {
      for (std::size_t far = 2; b + far <= plan.modes.size(); far *= 2) try_move({b, b + far, plan.modes[b - 1]});
      for (std::size_t far = 2; far <= b; far *= 2) try_move({b - far, b, plan.modes[b]});
    }
    if (best.to == 0) return false;
    std::fill(plan.modes.begin() + static_cast<std::ptrdiff_t>(best.from),
              plan.modes.begin() + static_cast<std::ptrdiff_t>(best.to), best.mode);
    roll_prefixes(problem, plan, best.from);
    return true;
  }

  void roll_prefixes(const Problem<M>& problem, const Plan<M>& plan, std::size_t from) noexcept {
    if (from == 0) prefix_[0] = Rollout<M>(problem);
    for (std::size_t b = from; b < plan.modes.size(); ++b) {
      prefix_[b + 1] = prefix_[b];
      roll(problem, plan, plan.modes[b], b, prefix_[b + 1]);
    }
  }

  /// The cost with the move, or infinity once it is not below the best.
  double cost_with(const Problem<M>& problem, const Plan<M>& plan, const Move& move) noexcept {
    Rollout<M> r = prefix_[move.from];
    for (std::size_t b = move.from; b < plan.modes.size(); ++b) {
      roll(problem, plan, b < move.to ? move.mode : plan.modes[b], b, r);
      if (!r.feasible || !(r.cost < cost_)) return Bounds<M>::infinity;
    }
    return judged(problem, r);
  }

  double judged(const Problem<M>& problem, const Rollout<M>& r) const noexcept {
    const double cost = total_cost(problem, r);
    return r.switches <= settings_.max_switches && std::isfinite(cost) ? cost : Bounds<M>::infinity;
  }

  void roll(const Problem<M>& problem, const Plan<M>& plan, int mode, std::size_t b, Rollout<M>& r) noexcept {
    roll_block(problem, timing_, mode, problem.horizon.blocks[b], plan.continuous[b], r);
    ++nodes_;
  }

  ModeSwapSettings settings_;
  SwitchTiming timing_;
  std::vector<Rollout<M>> prefix_;  // prefix_[b]: before block b of the plan
  double cost_ = 0.0;
  std::int64_t nodes_ = 0;
};

}  // namespace solenoid
