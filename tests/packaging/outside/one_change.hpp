#pragma once

#include <algorithm>
#include <chrono>

#include <solenoid/core/mpc/rollout.hpp>
#include <solenoid/core/mpc/solver.hpp>

/// Descent by single changes: as long as another mode in one block lowers the cost, the best such change is made.
///
/// minimise  problem.hpp over mode[b], b < blocks, among the neighbours of the warm start; continuous inputs as given
/// status    feasible: no single change is better    deadline_reached: stopped with the best so far
///           infeasible, numerical_failure: neither the warm start nor holding the mode in force has a finite cost
/// bound     0: no term of the cost is negative
/// promise   never worse than the warm start; no allocation, lock or exception in solve
template <solenoid::HybridModel M>
class OneChange final : public solenoid::Solver<M> {
 public:
  void prepare(const solenoid::Problem<M>& problem) override { trial_ = solenoid::Plan<M>(problem); }

  solenoid::SolveReport solve(const solenoid::Problem<M>& problem, solenoid::Plan<M>& plan,
                              solenoid::Deadline deadline) noexcept override {
    const auto start = solenoid::Deadline::Clock::now();
    nodes_ = 0;
    solenoid::SolveReport best = judge(problem, plan);
    if (best.status != solenoid::Status::feasible) {
      hold(problem, plan);
      best = judge(problem, plan);
    }
    while (best.status == solenoid::Status::feasible) {
      const bool changed = change(problem, plan, deadline, best);
      if (deadline.passed())
        best.status = solenoid::Status::deadline_reached;
      else if (!changed)
        break;
    }
    if (usable(best.status)) best.bound = 0.0;
    best.nodes = nodes_;
    best.time_us = std::chrono::duration<double, std::micro>(solenoid::Deadline::Clock::now() - start).count();
    return best;
  }

 private:
  solenoid::SolveReport judge(const solenoid::Problem<M>& problem, solenoid::Plan<M>& plan) noexcept {
    nodes_ += static_cast<std::int64_t>(plan.modes.size());
    return evaluate(problem, plan);
  }

  static void hold(const solenoid::Problem<M>& problem, solenoid::Plan<M>& plan) noexcept {
    const int in_force = std::max(0, problem.modes.find(problem.lines.commanded()));
    std::fill(plan.modes.begin(), plan.modes.end(), in_force);
  }

  /// Makes the best single change of those tried in time, if one lowers the cost.
  bool change(const solenoid::Problem<M>& problem, solenoid::Plan<M>& plan, solenoid::Deadline deadline,
              solenoid::SolveReport& best) noexcept {
    std::copy(plan.modes.begin(), plan.modes.end(), trial_.modes.begin());
    std::copy(plan.continuous.begin(), plan.continuous.end(), trial_.continuous.begin());
    std::size_t block = plan.modes.size();
    int to = 0;
    for (std::size_t b = 0; b < plan.modes.size() && !deadline.passed(); ++b) {
      for (int mode = 0; mode < problem.modes.size(); ++mode) {
        if (mode == plan.modes[b]) continue;
        trial_.modes[b] = mode;
        const solenoid::SolveReport changed = judge(problem, trial_);
        if (changed.status == solenoid::Status::feasible && changed.cost < best.cost)
          best = changed, block = b, to = mode;
      }
      trial_.modes[b] = plan.modes[b];
    }
    if (block == plan.modes.size()) return false;
    plan.modes[block] = to;
    return true;
  }

  solenoid::Plan<M> trial_;
  std::int64_t nodes_ = 0;
};
