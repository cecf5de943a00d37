#pragma once

#include "core/mpc/solver.hpp"
#include "solvers/search/proposer.hpp"
#include "solvers/search/sequence_lanes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>

namespace solenoid {

/// A policy proposes, the prediction disposes: the shifted warm start, holding the command in force and what a proposer
/// thinks best are rolled out together, and the cheapest that keeps to the limits is the plan.
///
/// ties      fewest switch changes, then the sequence of lowest mode numbers
/// promise   cost <= that of the warm start and <= that of holding, whatever is proposed; the cost is evaluate()'s to
///           the last bit; always the same work; no allocation, lock or exception in solve
/// status    feasible; infeasible and numerical_failure as every solver's. The bound is 0, below which no cost is.
template <HybridModel M>
class JudgedPolicy final : public Solver<M> {
 public:
  /// Sequences rolled out, the warm start and holding among them: two registers of eight lanes, which take about as
  /// long as one.
  static constexpr std::size_t candidates = 16;

  explicit JudgedPolicy(std::unique_ptr<Proposer<M>> proposer, const RolloutKernel<M>& kernel = rollout_kernel<M>())
      : proposer_(std::move(proposer)), lanes_(kernel) {}

  void prepare(const Problem<M>& problem) override {
    lanes_.prepare(problem);
    if (problem.horizon.blocks.size() > max_tree_blocks) throw std::invalid_argument("has room for 32 blocks");
    proposer_->prepare(problem);
    blocks_ = problem.horizon.blocks.size();
  }

  SolveReport solve(const Problem<M>& problem, Plan<M>& plan, Deadline /*deadline*/) noexcept override {
    const auto start = Deadline::Clock::now();
    const int hold = problem.modes.find(problem.lines.commanded());
    collect(problem, plan, hold);
    lanes_.start(problem, plan);
    const std::int64_t steps =
        lanes_.roll(problem, static_cast<int>(count_), [this](int lane, std::size_t b, const DelayLines&) {
          return static_cast<int>(sequences_[static_cast<std::size_t>(lane)][b]);
        });
    for (std::size_t i = 0; i < count_; ++i) cost_[i] = lanes_.cost(problem, static_cast<int>(i));
    SolveReport report = choose(hold, plan);
    report.bound = 0.0;
    report.nodes = static_cast<std::int64_t>(count_ * blocks_);
    report.model_steps = steps;
    report.time_us = us_since(start);
    return report;
  }

  /// There is no more to do than that, and never less by much.
  std::optional<MostWork> most_work(const AnyProblem& shape) const override {
    MostWork most;
    most.solve.nodes = static_cast<std::int64_t>(candidates * shape.horizon.blocks.size());
    most.solve.model_steps = lanes_.steps(static_cast<int>(candidates), shape.horizon);
    most.late = most.solve;  // it does not look at the clock
    return most;
  }
  bool do_most_work(bool /*on*/) noexcept override { return true; }

 private:
  /// Warm start, holding, then proposals that are neither.
  void collect(const Problem<M>& problem, const Plan<M>& plan, int hold) noexcept {
    const int last = problem.modes.size() - 1;
    ModeSequence warm{}, held{};
    for (std::size_t b = 0; b < blocks_; ++b) {
      warm[b] = static_cast<std::uint16_t>(std::clamp(plan.modes[b], 0, last));
      held[b] = hold >= 0 ? static_cast<std::uint16_t>(hold) : warm[b];
    }
    sequences_[0] = warm;
    count_ = 1;
    if (held != warm) sequences_[count_++] = held;
    const int proposed = proposer_->propose(problem, proposals_);
    for (std::size_t i = 0; i < static_cast<std::size_t>(proposed) && count_ < candidates; ++i)
      if (proposals_[i] != warm && proposals_[i] != held) sequences_[count_++] = proposals_[i];
  }

  SolveReport choose(int hold, Plan<M>& plan) const noexcept {
    SolveReport report;
    std::size_t best = count_;
    bool failed = false;
    for (std::size_t i = 0; i < count_; ++i) {
      failed = failed || std::isnan(cost_[i]);
      if (std::isfinite(cost_[i]) && (best == count_ || better(i, best))) best = i;
    }
    const bool found = best < count_;
    for (std::size_t b = 0; b < blocks_; ++b) plan.modes[b] = found ? sequences_[best][b] : std::max(0, hold);
    if (found) report.cost = cost_[best], report.switches = switches_of(best);
    report.status = found ? Status::feasible : failed ? Status::numerical_failure : Status::infeasible;
    return report;
  }

  int switches_of(std::size_t i) const noexcept { return lanes_.switches(static_cast<int>(i)); }

  bool better(std::size_t a, std::size_t b) const noexcept {
    if (cost_[a] != cost_[b]) return cost_[a] < cost_[b];
    if (switches_of(a) != switches_of(b)) return switches_of(a) < switches_of(b);
    return sequences_[a] < sequences_[b];
  }

  std::unique_ptr<Proposer<M>> proposer_;
  SequenceLanes<M> lanes_;
  std::array<double, candidates> cost_{};
  std::array<ModeSequence, candidates> sequences_{}, proposals_{};
  std::size_t count_ = 0, blocks_ = 0;
};

}  // namespace solenoid
