#pragma once

#include "core/mpc/relaxation.hpp"
#include "core/mpc/solver.hpp"
#include "solvers/rounding/continuous_refinement.hpp"
#include "solvers/rounding/integral_approximation.hpp"
#include "solvers/rounding/mode_swaps.hpp"
#include "solvers/rounding/sum_up_rounding.hpp"

#include <memory>
#include <type_traits>
#include <variant>

namespace solenoid {

/// How weights become modes.
enum class RoundingMethod : std::uint8_t { sum_up, integral_approximation };

/// What RelaxAndRound does with the weights, and within which limits.
struct RelaxAndRoundSettings {
  RoundingMethod method = RoundingMethod::sum_up;
  bool improve = true;     ///< mode swaps and, where there is one, the continuous input re-optimised
  bool keep_start = true;  ///< take the warm start, or the mode in force held, where that costs less than the rounding
  int max_switches = SwitchLimits::unlimited;
  std::int64_t max_nodes = 5000;  ///< of the integral approximation
  double relaxing_share = 0.5;    ///< of the time to the deadline
};

/// What the last solve did on its way. Costs by the exact physics; infinite where a step gave none.
struct RoundingTrace {
  Status relaxation = Status::numerical_failure, rounding = Status::numerical_failure;
  double relaxed_cost = std::numeric_limits<double>::infinity();
  double rounded_cost = std::numeric_limits<double>::infinity();  ///< of the rounding, re-simulated
  double gap = 0.0, gap_bound = 0.0;  ///< integral gap [steps]; sum_up: what the theory allows, else the proven bound
  double relaxing_us = 0.0, rounding_us = 0.0, improving_us = 0.0;
};

/// Relax, round, re-simulate, improve.
///
///     1. weights a[b][m] and u[b] from the relaxed problem, started from the warm start; an interval a block,
///        neighbours sharing one where a switch's delay is longer than a block
///     2. modes from the weights: sum-up rounding, or the integral approximation within the mode set's dwell times;
///        both change one switch at a time of a group
///     3. the true cost by evaluate(), beside that of the warm start and of holding the mode in force
///     4. the best of them: mode swaps, then the continuous input for the modes found, while either gains
///
/// status    feasible: rounded and improved to the end    deadline_reached, iteration_limit: stopped before
///           infeasible, numerical_failure: no plan of finite cost
/// bound     0: all terms of the cost are >= 0 (as mode swaps need). The relaxed cost is no bound, being local.
/// promise   no allocation, lock or exception in solve, if the relaxed solver keeps that; the same problem and warm
///           start give the same plan, whatever was solved before
template <HybridModel M>
class RelaxAndRound final : public Solver<M> {
 public:
  RelaxAndRound(std::unique_ptr<RelaxedSolver<M>> relaxed, const RelaxAndRoundSettings& settings = {})
      : settings_(settings),
        relaxed_(std::move(relaxed)),
        approximation_({.max_nodes = settings.max_nodes}),
        swaps_({.max_switches = settings.max_switches}) {}

  void prepare(const Problem<M>& problem) override {
    timing_ = SwitchTiming(problem.modes, problem.horizon.dt_s);
    grid_ = control_grid(problem.horizon, 0, timing_.longest_delay);
    relaxed_->prepare(problem, grid_);
    relaxed_plan_ = RelaxedPlan<M>(problem, grid_);
    weights_ = ModeWeights(problem.modes.size(), {problem.horizon.blocks.begin(), problem.horizon.blocks.end()});
    owed_.assign(static_cast<std::size_t>(problem.modes.size()), 0.0);
    limits_ = mode_set_limits(problem.modes, timing_, problem.lines);
    limits_.max_changes = settings_.max_switches;
    approximation_.prepare(weights_.intervals(), problem.modes.size(), problem.modes.switch_count());
    swaps_.prepare(problem);
    if constexpr (refines) refinement_.prepare(problem);
    rounded_ = best_ = Plan<M>(problem);
  }

  SolveReport solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept override {
    const auto start = Deadline::Clock::now();
    trace_ = RoundingTrace();
    report_ = SolveReport();
    report_.status = Status::infeasible;
    if (settings_.keep_start) adopt_starts(problem, plan);
    relax(problem, plan, deadline.share(settings_.relaxing_share));
    if (round(problem, deadline)) take_if_better(problem, rounded_, &trace_.rounded_cost);
    if (settings_.keep_start && !std::isfinite(report_.cost)) look_for_any(problem, deadline);
    if (settings_.improve && std::isfinite(report_.cost)) improve(problem, deadline);
    if (std::isfinite(report_.cost)) {
      copy(best_, plan);
      report_.bound = 0.0;
    } else {
      std::fill(plan.modes.begin(), plan.modes.end(), std::max(0, problem.modes.find(problem.lines.commanded())));
    }
    report_.time_us = us_since(start);
    return report_;
  }

  bool time_phases(PhaseTimes* into) noexcept override {
    relaxed_->time_phases(into);
    swaps_.time_phases(into);
    if constexpr (refines) refinement_.time_phases(into);
    return true;
  }

  const RoundingTrace& trace() const { return trace_; }
  const RelaxedPlan<M>& relaxed_plan() const { return relaxed_plan_; }

 private:
  static constexpr bool refines = M::continuous_size > 0;

  static void copy(const Plan<M>& from, Plan<M>& to) noexcept {
    std::copy(from.modes.begin(), from.modes.end(), to.modes.begin());
    std::copy(from.continuous.begin(), from.continuous.end(), to.continuous.begin());
  }

  void adopt_starts(const Problem<M>& problem, const Plan<M>& plan) noexcept {
    copy(plan, rounded_);
    for (int& mode : rounded_.modes) mode = std::clamp(mode, 0, problem.modes.size() - 1);
    take_if_better(problem, rounded_, nullptr);
    const int hold = problem.modes.find(problem.lines.commanded());
    if (hold < 0) return;
    std::fill(rounded_.modes.begin(), rounded_.modes.end(), hold);
    take_if_better(problem, rounded_, nullptr);
  }

  /// Neither the starts nor the rounding keep to the limits, which the relaxation knows nothing of: each mode held, and
  /// each mode for a block and then every other, until the first that does.
  void look_for_any(const Problem<M>& problem, Deadline deadline) noexcept {
    const int modes = problem.modes.size();
    for (int then = -1; then < modes; ++then)
      for (int first = 0; first < modes && !std::isfinite(report_.cost) && !deadline.passed(); ++first) {
        std::ranges::fill(rounded_.modes, then < 0 ? first : then);
        rounded_.modes.front() = first;
        take_if_better(problem, rounded_, nullptr);
      }
  }

  void take_if_better(const Problem<M>& problem, Plan<M>& candidate, double* cost) noexcept {
    const SolveReport judged = evaluate(problem, candidate);
    if (judged.status == Status::numerical_failure && !std::isfinite(report_.cost)) report_.status = judged.status;
    const bool kept = judged.status == Status::feasible && judged.switches <= settings_.max_switches;
    if (cost) *cost = kept ? judged.cost : Bounds<M>::infinity;
    if (!kept || !(judged.cost < report_.cost)) return;
    const std::int64_t nodes = report_.nodes;
    report_ = judged;
    report_.nodes = nodes;
    copy(candidate, best_);
  }

  void relax(const Problem<M>& problem, const Plan<M>& plan, Deadline deadline) noexcept {
    const auto start = Deadline::Clock::now();
    relax_plan(problem, grid_, std::isfinite(report_.cost) ? best_ : plan, relaxed_plan_);
    const SolveReport relaxed = relaxed_->solve(problem, relaxed_plan_, deadline);
    report_.nodes += relaxed.nodes;
    trace_.relaxation = relaxed.status;
    trace_.relaxed_cost = relaxed.cost;
    trace_.relaxing_us = us_since(start);
  }

  /// Modes into rounded_; false if the weights cannot be rounded or no sequence keeps to the limits.
  bool round(const Problem<M>& problem, Deadline deadline) noexcept {
    const auto start = Deadline::Clock::now();
    keep_relaxation(problem, grid_, relaxed_plan_, rounded_);
    std::ranges::copy(rounded_.relaxation.weights, weights_.weight.begin());
    if (!usable(trace_.relaxation) || !normalise(weights_)) return false;
    begin_after(timing_, problem.lines, limits_);
    const SumUpReport sum_up = limits_.one_at_a_time.empty()
                                   ? sum_up_rounding(weights_, rounded_.modes, owed_)
                                   : sum_up_rounding(weights_, limits_, rounded_.modes, owed_);
    trace_.rounding = sum_up.status;
    trace_.gap = sum_up.gap;
    trace_.gap_bound = sum_up.guarantee;
    if (settings_.method == RoundingMethod::integral_approximation) approximate(deadline);
    trace_.rounding_us = us_since(start);
    return usable(trace_.rounding);
  }

  void approximate(Deadline deadline) noexcept {
    const ApproximationReport found = approximation_.solve(weights_, limits_, rounded_.modes, deadline);
    report_.nodes += found.nodes;
    trace_.rounding = std::isfinite(found.cost) ? found.status : Status::infeasible;
    trace_.gap = found.cost;
    trace_.gap_bound = found.bound;
  }

  /// Mode swaps, then the continuous input, in turn while the second gains.
  void improve(const Problem<M>& problem, Deadline deadline) noexcept {
    const auto start = Deadline::Clock::now();
    Status status = Status::feasible;
    for (int round = 0; round < most_rounds; ++round) {
      const double before = report_.cost;
      status = follow(swaps_.improve(problem, best_, deadline));
      if constexpr (refines) {
        if (status == Status::feasible && continuous_is_free(problem))
          status = follow(refinement_.refine(problem, best_, deadline));
        if (status == Status::iteration_limit) status = Status::feasible;  // a local search either way
      }
      if (status != Status::feasible || !(report_.cost < before * (1.0 - 1e-6))) break;
      if (!refines || !continuous_is_free(problem)) break;
    }
    report_.status = status;
    trace_.improving_us = us_since(start);
  }

  Status follow(const SolveReport& step) noexcept {
    const std::int64_t nodes = report_.nodes + step.nodes;
    report_ = step;
    report_.nodes = nodes;
    return step.status;
  }

  /// Whether the problem weighs or bounds its continuous inputs: else they are not the solver's to choose.
  static bool continuous_is_free(const Problem<M>& problem) noexcept {
    for (std::size_t i = 0; i < M::continuous_size; ++i)
      if (problem.bounds.continuous_lower[i] > -Bounds<M>::infinity &&
          problem.bounds.continuous_upper[i] < Bounds<M>::infinity &&
          problem.bounds.continuous_lower[i] < problem.bounds.continuous_upper[i])
        return true;
    return false;
  }

  static constexpr int most_rounds = 5;
  RelaxAndRoundSettings settings_;
  std::unique_ptr<RelaxedSolver<M>> relaxed_;
  IntegralApproximation approximation_;
  ModeSwaps<M> swaps_;
  [[no_unique_address]] std::conditional_t<refines, ContinuousRefinement<M>, std::monostate> refinement_;
  SwitchTiming timing_;
  RelaxedGrid grid_;
  RelaxedPlan<M> relaxed_plan_;
  ModeWeights weights_;
  std::vector<double> owed_;
  SwitchLimits limits_;
  Plan<M> rounded_, best_;
  SolveReport report_;
  RoundingTrace trace_;
};

}  // namespace solenoid
