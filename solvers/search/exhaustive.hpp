#pragma once

#include "core/mpc/rollout.hpp"
#include "core/mpc/solver.hpp"
#include "solvers/search/tree_work.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace solenoid {

/// Exhaustive search over mode sequences, one scalar rollout at a time, shared prefixes rolled once.
///
/// minimise  problem.hpp over mode[b], b < blocks, with the plan's continuous inputs as given        [theory.md, eq. 1]
/// ties      fewest switch changes, then the sequence of lowest mode numbers
/// promise   the optimum unless the deadline comes first; no allocation, lock or exception in solve
///
/// With one block this is the DMPC search of the thesis (5.2). It is the oracle of every other search.
template <HybridModel M>
class Exhaustive final : public Solver<M> {
 public:
  void prepare(const Problem<M>& problem) override {
    const std::size_t blocks = problem.horizon.blocks.size();
    timing_ = SwitchTiming(problem.modes, problem.horizon.dt_s);
    path_.assign(blocks + 1, Rollout<M>());
    sequence_.assign(blocks, 0);
    best_.assign(blocks, 0);
  }

  SolveReport solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept override {
    const auto start = Deadline::Clock::now();
    report_ = SolveReport{};
    any_feasible_ = false;
    path_[0] = Rollout<M>(problem);
    const bool complete = expand(problem, plan, 0, deadline);
    conclude(problem, plan, complete);
    report_.time_us = us_since(start);
    return report_;
  }

  /// Every sequence, one block between two looks at the clock.
  std::optional<MostWork> most_work(const AnyProblem& shape) const override {
    const std::vector<int>& blocks = shape.horizon.blocks;
    MostWork most = most_tree_work(shape.modes, {.block_steps = blocks});
    most.late = {.nodes = 1, .model_steps = *std::ranges::max_element(blocks)};
    return most;
  }
  bool do_most_work(bool /*on*/) noexcept override { return true; }

 private:
  /// Tries every mode in block b after the prefix in sequence_; false when the deadline has passed.
  bool expand(const Problem<M>& problem, const Plan<M>& plan, std::size_t b, Deadline deadline) noexcept {
    if (b == sequence_.size()) {
      keep_if_better(total_cost(problem, path_[b]), path_[b]);
      return true;
    }
    for (int mode = 0; mode < problem.modes.size(); ++mode) {
      if (deadline.passed()) return false;
      if (!path_[b].lines.may_command(problem.modes.pattern(mode), timing_)) continue;
      sequence_[b] = mode;
      path_[b + 1] = path_[b];
      roll_block(problem, timing_, mode, problem.horizon.blocks[b], plan.continuous[b], path_[b + 1]);
      ++report_.nodes;
      report_.model_steps += problem.horizon.blocks[b];
      if (path_[b + 1].feasible && !expand(problem, plan, b + 1, deadline)) return false;
    }
    return true;
  }

  void keep_if_better(double cost, const Rollout<M>& leaf) noexcept {
    any_feasible_ = any_feasible_ || leaf.feasible;
    const bool better = cost < report_.cost || (cost == report_.cost && leaf.switches < report_.switches);
    if (!better || !std::isfinite(cost)) return;
    report_.cost = cost;
    report_.switches = leaf.switches;
    std::copy(sequence_.begin(), sequence_.end(), best_.begin());
  }

  void conclude(const Problem<M>& problem, Plan<M>& plan, bool complete) noexcept {
    const bool found = std::isfinite(report_.cost);
    const int hold = std::max(0, problem.modes.find(problem.lines.commanded()));
    for (std::size_t b = 0; b < best_.size(); ++b) plan.modes[b] = found ? best_[b] : hold;
    if (!complete)
      report_.status = Status::deadline_reached, report_.bound = 0.0;
    else if (found)
      report_.status = Status::optimal, report_.bound = report_.cost;
    else
      report_.status = any_feasible_ ? Status::numerical_failure : Status::infeasible;
  }

  SwitchTiming timing_;
  std::vector<Rollout<M>> path_;  // path_[b]: before block b
  std::vector<int> sequence_, best_;
  SolveReport report_;
  bool any_feasible_ = false;
};

}  // namespace solenoid
