#pragma once

#include "solvers/learned/mlp.hpp"
#include "solvers/learned/network_proposer.hpp"
#include "solvers/learned/problem_features.hpp"
#include "solvers/learned/tail_lanes.hpp"
#include "solvers/search/sequence_lanes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace solenoid {

/// What the blocks that are left cost at best, as far as somebody knows.
template <HybridModel M>
class TailCost {
 public:
  virtual ~TailCost() = default;
  /// For problems of this shape, of which the blocks from `first_block` on are left. May allocate; throws
  /// std::invalid_argument, saying what does not fit.
  virtual void prepare(const Problem<M>& problem, std::size_t first_block) = 0;
  /// At the state and with the commands in flight with which block first_block begins. No allocation, no exception.
  virtual double cost(const Problem<M>& problem, const StateOf<M>& state, const DelayLines& lines) noexcept = 0;
};

/// The kind of network that gives the optimal cost of the blocks that are left.
inline constexpr const char* cost_kind = "cost";

/// The layout of a learned cost: features, and the weights that it is a cost of.
template <HybridModel M>
std::string cost_layout(const ProblemFeatures<M>& features, const Problem<M>& problem) {
  return features.layout() + "; " + weights_text(problem);
}

/// A network has learned it.
template <HybridModel M>
class NetworkTailCost final : public TailCost<M> {
 public:
  explicit NetworkTailCost(std::shared_ptr<const Mlp> network) : network_(std::move(network)) {}

  void prepare(const Problem<M>& problem, std::size_t first_block) override {
    features_.prepare(problem, first_block);
    require_fitting(network_->data(), cost_kind, cost_layout(features_, problem));
    if (network_->features() != features_.size() || network_->outputs() != 1)
      throw std::invalid_argument("has not one output, or other features than it says");
    values_.resize(features_.size());
  }
  double cost(const Problem<M>& problem, const StateOf<M>& state, const DelayLines& lines) noexcept override {
    features_.write(problem, state, lines, values_);
    float y = 0.0f;
    network_->evaluate(values_, std::span(&y, 1));
    const double floor = network_->data().log_floor;
    return floor > 0.0 ? std::max(0.0, std::exp(static_cast<double>(y)) - floor)
                       : std::max(0.0, static_cast<double>(y));
  }

 private:
  std::shared_ptr<const Mlp> network_;
  ProblemFeatures<M> features_;
  std::vector<float> values_;
};

/// Searches the first blocks and lets somebody say what the rest costs:
///
///     1. the warm start and holding are rolled out: what a sequence may cost at most
///     2. every sequence of the first `searched` blocks, a SIMD lane each; one that costs more already is dropped
///     3. at the end of each of the others the cost of the blocks left is asked for; the three cheapest sums are taken
///     4. their blocks left are filled greedily: one after the other, its mode held to the end, beside the warm start's
///     5. the cheapest of all that was rolled out whole is the plan
///
/// promise   the plan costs what evaluate() says, and no more than the warm start and holding; without an error in the
///           cost of the blocks left, step 3 has the first blocks of an optimum; no allocation, lock or exception in solve
/// status    feasible: what is left is not searched; deadline_reached: nor all that should have been. The bound is 0.
template <HybridModel M>
class TailSearch final : public Solver<M> {
 public:
  /// Sequences of all searched blocks but the last that there is room for.
  static constexpr std::size_t most_nodes = 65536;

  TailSearch(std::unique_ptr<TailCost<M>> rest, int searched)
      : rest_(std::move(rest)), searched_(static_cast<std::size_t>(searched)) {}

  void prepare(const Problem<M>& problem) override {
    const std::size_t blocks = problem.horizon.blocks.size();
    if (blocks > max_tree_blocks) throw std::invalid_argument("has room for 32 blocks");
    if (searched_ < 1 || searched_ >= blocks)
      throw std::invalid_argument(fmt::format("{} of {} blocks cannot be searched before a rest (allowed: 1 to {})",
                                              searched_, blocks, blocks - 1));
    std::size_t nodes = 1;
    for (std::size_t b = 0; b + 1 < searched_; ++b) {
      nodes *= static_cast<std::size_t>(problem.modes.size());
      if (nodes > most_nodes)
        throw std::invalid_argument(
            fmt::format("{} modes in {} searched blocks are too many (allowed: {} sequences before the last of them)",
                        problem.modes.size(), searched_, most_nodes));
    }
    whole_.prepare(problem);
    tree_.prepare(problem, searched_, nodes);
    rest_->prepare(problem, searched_);
  }

  SolveReport solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept override {
    const auto start = Deadline::Clock::now();
    report_ = SolveReport{};
    report_.bound = 0.0;
    failed_ = false;
    hold_ = problem.modes.find(problem.lines.commanded());
    judge_incumbents(problem, plan);
    const auto leaf = [&](const StateOf<M>& state, const DelayLines& lines) {
      return rest_->cost(problem, state, lines);
    };
    const auto firsts = tree_.search(problem, plan, report_, deadline, leaf);
    stopped_ = tree_.stopped();
    fill(problem, plan, firsts, deadline);
    conclude(plan);
    report_.time_us = us_since(start);
    return report_;
  }

 private:
  void judge_incumbents(const Problem<M>& problem, const Plan<M>& plan) noexcept {
    const int last = problem.modes.size() - 1;
    for (std::size_t b = 0; b < plan.modes.size(); ++b) {
      warm_[b] = static_cast<std::uint16_t>(std::clamp(plan.modes[b], 0, last));
      sequences_[1][b] = hold_ >= 0 ? static_cast<std::uint16_t>(hold_) : warm_[b];
    }
    sequences_[0] = warm_;
    judge(problem, plan, 2);
  }

  /// Fills the blocks behind the searched ones of each of these.
  void fill(const Problem<M>& problem, const Plan<M>& plan, std::span<const ModeSequence> firsts,
            Deadline deadline) noexcept {
    if (firsts.empty()) return;
    std::ranges::copy(firsts, firsts_.begin());
    const std::size_t blocks = plan.modes.size(), ways = static_cast<std::size_t>(max_lanes) / firsts.size();
    const int modes = std::min(problem.modes.size(), static_cast<int>(ways) - 2);
    const std::size_t tried = static_cast<std::size_t>(modes) + 2;
    for (std::size_t b = searched_; b < blocks; ++b) {
      stopped_ = stopped_ || deadline.passed();
      if (stopped_) return;
      for (std::size_t f = 0; f < firsts.size(); ++f)
        for (std::size_t way = 0; way < tried; ++way) {
          ModeSequence& s = sequences_[f * tried + way] = firsts_[f];
          for (std::size_t k = b; k < blocks; ++k)
            s[k] = way == 0 ? warm_[k] : held_mode(problem, s, b, way - 1, modes);
        }
      judge(problem, plan, firsts.size() * tried);
      for (std::size_t f = 0; f < firsts.size(); ++f) {
        const auto own = std::span(cost_).subspan(f * tried, tried);
        firsts_[f] = sequences_[f * tried + static_cast<std::size_t>(std::ranges::min_element(own) - own.begin())];
      }
    }
  }

  /// The mode of block b - 1 held on, or one of the `modes` that are tried: of more some, evenly.
  static std::uint16_t held_mode(const Problem<M>& problem, const ModeSequence& s, std::size_t b, std::size_t way,
                                 int modes) noexcept {
    if (way == 0) return s[b - 1];
    return static_cast<std::uint16_t>((static_cast<int>(way) - 1) * problem.modes.size() / modes);
  }

  /// Rolls the first so many of sequences_ out, into cost_; one that is no plan costs infinity.
  void judge(const Problem<M>& problem, const Plan<M>& plan, std::size_t count) noexcept {
    whole_.start(problem, plan);
    report_.model_steps +=
        whole_.roll(problem, static_cast<int>(count), [this](int lane, std::size_t b, const DelayLines&) {
          return static_cast<int>(sequences_[static_cast<std::size_t>(lane)][b]);
        });
    report_.nodes += static_cast<std::int64_t>(count * plan.modes.size());
    for (std::size_t i = 0; i < count; ++i) {
      cost_[i] = whole_.cost(problem, static_cast<int>(i));
      failed_ = failed_ || std::isnan(cost_[i]);
      if (std::isfinite(cost_[i]))
        keep_if_better(i);
      else
        cost_[i] = Bounds<M>::infinity;
    }
  }

  void keep_if_better(std::size_t i) noexcept {
    const double cost = cost_[i];
    const int switches = whole_.switches(static_cast<int>(i));
    if (cost > report_.cost) return;
    if (cost == report_.cost && switches > report_.switches) return;
    if (cost == report_.cost && switches == report_.switches && !(sequences_[i] < best_)) return;
    report_.cost = cost;
    report_.switches = switches;
    best_ = sequences_[i];
  }

  void conclude(Plan<M>& plan) noexcept {
    const bool found = std::isfinite(report_.cost);
    for (std::size_t b = 0; b < plan.modes.size(); ++b) plan.modes[b] = found ? best_[b] : std::max(0, hold_);
    report_.status = stopped_  ? Status::deadline_reached
                     : found   ? Status::feasible
                     : failed_ ? Status::numerical_failure
                               : Status::infeasible;
  }

  std::unique_ptr<TailCost<M>> rest_;
  std::size_t searched_;
  SequenceLanes<M> whole_;
  TailLanes<M> tree_;
  std::array<ModeSequence, max_lanes> sequences_{};
  std::array<double, max_lanes> cost_{};
  std::array<ModeSequence, TailLanes<M>::kept> firsts_{};
  ModeSequence warm_{}, best_{};
  SolveReport report_;
  bool failed_ = false, stopped_ = false;
  int hold_ = -1;
};

}  // namespace solenoid
