#pragma once

#include "core/mpc/relaxation.hpp"
#include "core/mpc/solver.hpp"
#include "solvers/rounding/mode_weights.hpp"
#include "solvers/rounding/pulse_width.hpp"

#include <memory>

namespace solenoid {

/// The grid of RelaxAndPulse.
struct RelaxAndPulseSettings {
  int interval =
      5;  ///< steps in which the relaxed inputs are held, as a rule a control period; longer for longer delays
};

/// Relax, then cut into pulses of whole steps.                                           [theory-relaxed.md, sect. 6]
///
///     1. weights a[k][m] and u[k] an interval from the relaxed problem, started from the relaxation that rides in the
///        warm start, or from its modes where there is none
///     2. a mode a step from the weights, by PulseWidth; what the warm start says is owed is made up for
///     3. what that costs, by evaluate()
///
/// shapes    problem.horizon: blocks of one step each
/// status    that of the relaxation where its plan can be used, but feasible for optimal: pulses prove nothing
/// bound     0: all terms of the cost are >= 0. The relaxed cost is no bound, being local.
/// promise   no allocation, lock or exception in solve, if the relaxed solver keeps that; the same problem and warm
///           start give the same plan, whatever was solved before, unless it was anticipated. Without a usable plan the
///           warm start is left as it came.
template <HybridModel M>
class RelaxAndPulse final : public Solver<M> {
 public:
  RelaxAndPulse(std::unique_ptr<RelaxedSolver<M>> relaxed, const RelaxAndPulseSettings& settings)
      : settings_(settings), relaxed_(std::move(relaxed)) {}

  void prepare(const Problem<M>& problem) override {
    for (const int length : problem.horizon.blocks)
      if (length != 1) throw std::invalid_argument("pulse width: every block of the horizon has to be one step");
    const SwitchTiming timing(problem.modes, problem.horizon.dt_s);
    grid_ = control_grid(problem.horizon, 0, std::max(timing.longest_delay, settings_.interval));
    relaxed_->prepare(problem, grid_);
    relaxed_plan_ = RelaxedPlan<M>(problem, grid_);
    weights_ = ModeWeights(problem.modes.size(), std::vector<double>(problem.horizon.blocks.size(), 1.0));
    pulses_.prepare(problem.modes, timing, grid_);
    start_ = made_ = Plan<M>(problem);
  }

  SolveReport solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept override {
    const auto begun = Deadline::Clock::now();
    start_from(problem, plan);
    const SolveReport relaxed = relaxed_->solve(problem, relaxed_plan_, deadline);
    SolveReport report;
    report.status = usable(relaxed.status) ? cut(problem, report) : relaxed.status;
    if (usable(report.status)) {
      if (relaxed.status != Status::optimal) report.status = relaxed.status;
      report.bound = 0.0;
      plan.modes = made_.modes;
      plan.continuous = made_.continuous;
      plan.relaxation = made_.relaxation;
    }
    report.nodes = relaxed.nodes;
    report.anticipated = relaxed.anticipated;
    report.time_us = us_since(begun);
    return report;
  }

  bool anticipates() const override { return relaxed_->anticipates(); }
  void anticipate(const Problem<M>& expected, const Plan<M>& warm_start) noexcept override {
    start_from(expected, warm_start);
    relaxed_->anticipate(expected, relaxed_plan_);
  }
  bool time_phases(PhaseTimes* into) noexcept override { return relaxed_->time_phases(into); }

  const RelaxedPlan<M>& relaxed_plan() const { return relaxed_plan_; }

 private:
  /// The warm start as a point of the relaxed problem. A relaxation that is none, and modes that are none, start
  /// nothing.
  void start_from(const Problem<M>& problem, const Plan<M>& plan) noexcept {
    for (std::size_t b = 0; b < plan.modes.size(); ++b) {
      start_.modes[b] = std::clamp(plan.modes[b], 0, problem.modes.size() - 1);
      start_.continuous[b] = plan.continuous[b];
    }
    start_.relaxation.known = false;
    if (plan.relaxation.known && plan.relaxation.weights.size() == weights_.weight.size()) {
      std::ranges::copy(plan.relaxation.weights, weights_.weight.begin());
      start_.relaxation.known = is_normalised(weights_);
      std::ranges::copy(weights_.weight, start_.relaxation.weights.begin());
    }
    owed_ = start_.relaxation.known ? plan.relaxation.owed.front() : SwitchStates<double>{};
    relax_plan(problem, grid_, start_, relaxed_plan_);
  }

  /// The relaxed plan cut into pulses, judged by the exact physics.
  Status cut(const Problem<M>& problem, SolveReport& report) noexcept {
    keep_relaxation(problem, grid_, relaxed_plan_, made_);
    std::ranges::copy(made_.relaxation.weights, weights_.weight.begin());
    if (!normalise(weights_)) return Status::numerical_failure;
    std::ranges::copy(weights_.weight, made_.relaxation.weights.begin());
    pulses_.round(problem.modes, problem.lines, relaxed_plan_.weights, owed_, made_.modes, made_.relaxation.owed);
    report = evaluate(problem, made_);
    return report.status;
  }

  RelaxAndPulseSettings settings_;
  std::unique_ptr<RelaxedSolver<M>> relaxed_;
  RelaxedGrid grid_;
  RelaxedPlan<M> relaxed_plan_;
  ModeWeights weights_;  // a step each: checks and normalises
  PulseWidth pulses_;
  SwitchStates<double> owed_{};  // as the problem begins
  Plan<M> start_, made_;
};

}  // namespace solenoid
