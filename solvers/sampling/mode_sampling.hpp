#pragma once

#include "core/mpc/phases.hpp"
#include "core/mpc/solver.hpp"
#include "solvers/sampling/categorical.hpp"
#include "solvers/sampling/sampling_settings.hpp"
#include "solvers/search/sequence_lanes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

namespace solenoid {

/// Sampling MPC over modes: sequences drawn from one categorical distribution a block, which moves towards the good ones.
///
/// minimise  problem.hpp over mode[b], b < blocks, with the plan's continuous inputs as given
///     p[b]     a distribution over the modes; at first half of it the warm start's (its weights where it has them, else
///              its modes), the rest uniform
///     repeat   draw sequences from p;  each block flips one switch more with the probability `mutation`, where that is a mode
///              and allowed;  what dwells, windows or groups forbid is drawn again, in the end the mode in force is held;
///              p <- smoothing p + (1 - smoothing) frequencies of the elites, or the weighted frequencies of all
/// shapes    the distribution rides in the plan's relaxation: the next solve begins with it, shifted
/// status    feasible; deadline_reached where not all samples were drawn    bound   0: no term of the cost is negative
/// promise   anytime: never worse than the warm start or than holding the command in force; the same problem, warm start
///           and seed give the same plan, on time; no allocation, lock or exception in solve
///
/// R. Y. Rubinstein, "The cross-entropy method for combinatorial and continuous optimization", Methodology and Computing in
/// Applied Probability 1(2), 127-190, 1999;  G. Williams, P. Drews, B. Goldfain, J. M. Rehg, E. A. Theodorou,
/// "Information-theoretic model predictive control", IEEE Transactions on Robotics 34(6), 1603-1622, 2018, whose
/// Gaussian inputs are modes here.
template <HybridModel M>
class ModeSampling final : public Solver<M> {
 public:
  explicit ModeSampling(const ModeSamplingSettings& settings, const RolloutKernel<M>& kernel = rollout_kernel<M>())
      : settings_(settings), lanes_(kernel) {}

  void prepare(const Problem<M>& problem) override {
    blocks_ = problem.horizon.blocks.size();
    modes_ = static_cast<std::size_t>(problem.modes.size());
    lanes_.prepare(problem);
    distribution_.prepare(blocks_, modes_);
    next_.resize(blocks_ * modes_);
    iterations_ = updates();
    const auto most = static_cast<std::size_t>(std::max(1, (settings_.samples + iterations_ - 1) / iterations_));
    sampled_.resize(most * blocks_);
    cost_.resize(most);
    order_.resize(most);
    best_.resize(blocks_);
    prepare_neighbours(problem.modes);
  }

  SolveReport solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept override {
    const auto start = Deadline::Clock::now();
    report_ = SolveReport{};
    numerical_failure_ = false;
    hold_ = problem.modes.find(problem.lines.commanded());
    random_ = RandomBits(seed_of(problem));
    lanes_.start(problem, plan);
    try_what_is_known(problem, plan);
    start_from(plan);
    bool complete = true;
    for (int i = 0, drawn = 0; i < iterations_ && complete; ++i) {
      const int count = (settings_.samples - drawn) / (iterations_ - i);
      complete = sample(problem, count, deadline);
      drawn += count;
      if (complete && i + 1 < iterations_) follow(count);
    }
    conclude(plan, complete);
    report_.time_us = us_since(start);
    return report_;
  }

  /// What is known, and every sample: always the same, unless the deadline comes between two groups of lanes.
  std::optional<MostWork> most_work(const AnyProblem& shape) const override {
    const auto blocks = static_cast<std::int64_t>(shape.horizon.blocks.size());
    const auto group = [&](int count) {
      return SolveWork{.nodes = count * blocks, .model_steps = lanes_.steps(count, shape.horizon)};
    };
    MostWork most{.solve = group(known_sequences), .late = group(max_lanes)};
    const int iterations = updates();
    for (int i = 0, drawn = 0; i < iterations; ++i) {
      const int count = (settings_.samples - drawn) / (iterations - i);
      const SolveWork whole = group(max_lanes), rest = group(count % max_lanes);
      most.solve.nodes += count / max_lanes * whole.nodes + rest.nodes;
      most.solve.model_steps += count / max_lanes * whole.model_steps + rest.model_steps;
      drawn += count;
    }
    return most;
  }
  bool do_most_work(bool /*on*/) noexcept override { return true; }

  bool time_phases(PhaseTimes* into) noexcept override {
    phases_ = into;
    return true;
  }

 private:
  static constexpr int tries = 4;            // draws for a block, the first included, before its mode is held
  static constexpr int known_sequences = 2;  // the warm start and holding

  int updates() const noexcept { return std::clamp(settings_.iterations, 1, std::max(1, settings_.samples)); }

  /// Each mode's patterns with one switch flipped, where that is a mode.
  void prepare_neighbours(const ModeSet& modes) {
    switches_ = static_cast<std::uint32_t>(modes.switch_count());
    neighbour_.clear();
    for (const Mode& mode : modes.modes())
      for (std::uint32_t c = 0; c < switches_; ++c)
        neighbour_.push_back(modes.find(mode.pattern ^ (SwitchPattern{1} << c)));
  }

  /// Draws differ from one initial state to another, and are the same for the same one.
  std::uint64_t seed_of(const Problem<M>& problem) const noexcept {
    std::uint64_t seed = mixed_bits(settings_.seed);
    for (const double x : problem.initial) seed = mixed_bits(seed ^ std::bit_cast<std::uint64_t>(x));
    return seed;
  }

  /// The warm start, and holding the command in force.
  void try_what_is_known(const Problem<M>& problem, const Plan<M>& plan) noexcept {
    const int most = static_cast<int>(modes_) - 1;
    const auto known = [&](int lane, std::size_t b) {
      return lane == 0 || hold_ < 0 ? std::clamp(plan.modes[b], 0, most) : hold_;
    };
    roll(problem, known_sequences, [&](int lane, std::size_t b, const DelayLines&) { return known(lane, b); });
    for (int lane = 0; lane < known_sequences; ++lane)
      keep_if_better(problem, lane, [&](std::size_t b) { return known(lane, b); });
  }

  /// The distribution to begin with. Weights that are none are as good as uniform.
  void start_from(const Plan<M>& plan) noexcept {
    const std::span<double> p = distribution_.probabilities();
    const bool weights = plan.relaxation.known && plan.relaxation.weights.size() == p.size();
    if (weights) {
      std::ranges::copy(plan.relaxation.weights, p.begin());
    } else {
      std::ranges::fill(p, 0.0);
      for (std::size_t b = 0; b < blocks_; ++b)
        p[b * modes_ + static_cast<std::size_t>(std::clamp(plan.modes[b], 0, static_cast<int>(modes_) - 1))] = 1.0;
    }
    distribution_.tabulate();
    for (double& x : p) x = 0.5 * x + 0.5 / static_cast<double>(modes_);
    distribution_.tabulate();
  }

  /// Draws and rolls so many sequences; false if the deadline came first.
  bool sample(const Problem<M>& problem, int count, Deadline deadline) noexcept {
    for (int done = 0; done < count; done += max_lanes) {
      if (deadline.passed()) return false;
      const int group = std::min(max_lanes, count - done);
      const auto modes_of = [&](int lane) { return &sampled_[static_cast<std::size_t>(done + lane) * blocks_]; };
      roll(problem, group, [&](int lane, std::size_t b, const DelayLines& lines) {
        const int before = b > 0 ? modes_of(lane)[b - 1] : hold_;
        const int mode = draw(problem, b, before, lines);
        modes_of(lane)[b] = static_cast<std::uint16_t>(mode);
        return mode;
      });
      for (int lane = 0; lane < group; ++lane)
        cost_[static_cast<std::size_t>(done + lane)] =
            keep_if_better(problem, lane, [&](std::size_t b) { return modes_of(lane)[b]; });
    }
    return true;
  }

  /// A mode for block b on top of these commands, `before` being the one they end with, or -1.
  int draw(const Problem<M>& problem, std::size_t b, int before, const DelayLines& lines) noexcept {
    const auto allowed = [&](int mode) {
      return mode == before || lines.may_command(problem.modes.pattern(mode), lanes_.timing());
    };
    int mode = distribution_.draw(b, random_.next());
    for (int i = 1; i < tries && !allowed(mode); ++i) mode = distribution_.draw(b, random_.next());
    if (!allowed(mode) && before >= 0) mode = before;
    if (static_cast<double>(random_.next() >> 11) * 0x1p-53 >= settings_.mutation) return mode;
    const int other = neighbour_[static_cast<std::size_t>(mode) * switches_ + random_.below(switches_)];
    return other >= 0 && allowed(other) ? other : mode;
  }

  template <class Choose>
  void roll(const Problem<M>& problem, int count, Choose&& choose) noexcept {
    const PhaseScope timed(phases_, Phase::rollout);
    report_.model_steps += lanes_.roll(problem, count, choose);
    report_.nodes += static_cast<std::int64_t>(count) * static_cast<std::int64_t>(blocks_);
  }

  /// Of two that cost the same the first with the fewest switches. Returns the lane's cost, no number made infinite.
  template <class ModeOf>
  double keep_if_better(const Problem<M>& problem, int lane, ModeOf mode_of) noexcept {
    const double cost = lanes_.cost(problem, lane);
    numerical_failure_ = numerical_failure_ || std::isnan(cost);
    if (!std::isfinite(cost)) return Bounds<M>::infinity;
    if (cost < report_.cost || (cost == report_.cost && lanes_.switches(lane) < report_.switches)) {
      report_.cost = cost;
      report_.switches = lanes_.switches(lane);
      for (std::size_t b = 0; b < blocks_; ++b) best_[b] = mode_of(b);
    }
    return cost;
  }

  /// Moves the distribution towards the good ones of the last `count` samples.
  void follow(int count) noexcept {
    std::ranges::fill(next_, 0.0);
    if (settings_.update == SamplingUpdate::elites)
      count_elites(count);
    else
      count_weighted(count);
    const std::span<double> p = distribution_.probabilities();
    for (std::size_t b = 0; b < blocks_; ++b) {
      const auto row = std::span(next_).subspan(b * modes_, modes_);
      const double sum = std::accumulate(row.begin(), row.end(), 0.0);
      if (!(sum > 0.0)) return;  // no sample keeps to the limits
      for (std::size_t m = 0; m < modes_; ++m)
        p[b * modes_ + m] = settings_.smoothing * p[b * modes_ + m] + (1.0 - settings_.smoothing) * row[m] / sum;
    }
    distribution_.tabulate();
  }

  void count_elites(int count) noexcept {
    const auto all = order_.begin() + count;
    std::iota(order_.begin(), all, std::uint32_t{0});
    const auto few = order_.begin() + std::clamp(static_cast<int>(std::lround(settings_.elites * count)), 1, count);
    if (few != all)
      std::nth_element(order_.begin(), few, all, [this](std::uint32_t a, std::uint32_t b) {
        return cost_[a] < cost_[b] || (cost_[a] == cost_[b] && a < b);
      });
    for (auto at = order_.begin(); at != few; ++at)
      if (std::isfinite(cost_[*at])) add(*at, 1.0);
  }

  void count_weighted(int count) noexcept {
    double least = Bounds<M>::infinity, sum = 0.0;
    int finite = 0;
    for (int i = 0; i < count; ++i)
      if (const double cost = cost_[static_cast<std::size_t>(i)]; std::isfinite(cost))
        least = std::min(least, cost), sum += cost, ++finite;
    const double mean_above = std::max(sum / std::max(finite, 1) - least, 0.0);  // equal costs may sum up to less
    const double spread = std::max(settings_.temperature * mean_above, std::numeric_limits<double>::min());
    for (int i = 0; i < count; ++i) {
      const double above = cost_[static_cast<std::size_t>(i)] - least;
      if (std::isfinite(above)) add(static_cast<std::uint32_t>(i), above > 0.0 ? std::exp(-above / spread) : 1.0);
    }
  }

  void add(std::uint32_t sample, double weight) noexcept {
    for (std::size_t b = 0; b < blocks_; ++b) next_[b * modes_ + sampled_[sample * blocks_ + b]] += weight;
  }

  void conclude(Plan<M>& plan, bool complete) noexcept {
    const bool found = std::isfinite(report_.cost);
    for (std::size_t b = 0; b < blocks_; ++b) plan.modes[b] = found ? best_[b] : std::max(0, hold_);
    report_.bound = 0.0;
    report_.status = !complete            ? Status::deadline_reached
                     : found              ? Status::feasible
                     : numerical_failure_ ? Status::numerical_failure
                                          : Status::infeasible;
    plan.relaxation.known = found && plan.relaxation.weights.size() == blocks_ * modes_;
    if (plan.relaxation.known) std::ranges::copy(distribution_.probabilities(), plan.relaxation.weights.begin());
  }

  ModeSamplingSettings settings_;
  SequenceLanes<M> lanes_;
  CategoricalBlocks distribution_;
  RandomBits random_{1};
  PhaseTimes* phases_ = nullptr;
  std::size_t blocks_ = 0, modes_ = 0;
  std::uint32_t switches_ = 0;
  int iterations_ = 1, hold_ = -1;
  bool numerical_failure_ = false;
  std::vector<double> next_;            // what the distribution moves towards
  std::vector<std::uint16_t> sampled_;  // sample-major
  std::vector<double> cost_;
  std::vector<std::uint32_t> order_;
  std::vector<int> best_, neighbour_;  // the latter mode-major: with switch c flipped, or -1
  SolveReport report_;
};

}  // namespace solenoid
