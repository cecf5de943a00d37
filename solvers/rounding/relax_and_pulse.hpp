#pragma once

#include "core/mpc/relaxation.hpp"
#include "core/mpc/solver.hpp"
#include "solvers/rounding/delta_sigma.hpp"
#include "solvers/rounding/dynamic_quantiser.hpp"
#include "solvers/rounding/mode_weights.hpp"
#include "solvers/rounding/pulse_width.hpp"

#include <memory>
#include <optional>

namespace solenoid {

/// What makes single steps of relaxed switch states.
enum class Modulation : std::uint8_t { pulse_width, delta_sigma, delta_sigma_2, dynamic_quantiser };

/// What RelaxAndPulse does with a relaxed plan, and on which grid.
struct RelaxAndPulseSettings {
  int interval =
      5;  ///< steps in which the relaxed inputs are held, as a rule a control period; longer for longer delays
  Modulation modulation = Modulation::pulse_width;
  bool informed = false;     ///< what is owed is in the prediction that the relaxed inputs are planned by
  double edge_price = 0.05;  ///< what a change has to gain, in squared steps that are owed
};

/// Relax, then cut into pulses of whole steps.                                           [theory-relaxed.md, sect. 6]
///
///     1. weights a[k][m] and u[k] an interval from the relaxed problem, started from the relaxation that rides in the
///        warm start, or from its modes where there is none
///     2. a mode a step from the weights, by a modulator; what the warm start says is owed is made up for
///     3. what that costs, by evaluate()
///
/// Uninformed, what is owed is planned for twice: the state that the problem begins with has not had it, so that the
/// relaxation asks for it again, and the modulator adds it. Informed, the relaxation begins with what the modulator is
/// about to make up for and plans the rest: in the linearised plant x+ = A x + B b with s owed and t the sum of it,
///
///     x0 + B s + (A - I) B (t - s)
///
/// on-times d_k of the steps k = 0, 1, .. with sum d_k = s, and for a modulator of second order sum k d_k = -t, as they
/// end in the state: sum A^(-1-k) B d_k to first order in A - I.
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
      if (length != 1) throw std::invalid_argument("pulses: every block of the horizon has to be one step");
    const SwitchTiming timing(problem.modes, problem.horizon.dt_s);
    grid_ = control_grid(problem.horizon, 0, std::max(timing.longest_delay, settings_.interval));
    relaxed_->prepare(problem, grid_);
    relaxed_plan_ = RelaxedPlan<M>(problem, grid_);
    weights_ = ModeWeights(problem.modes.size(), std::vector<double>(problem.horizon.blocks.size(), 1.0));
    modulator_ = make_modulator(problem);
    modulator_->prepare(problem.modes, timing, grid_);
    if (settings_.informed) ahead_.emplace(problem), plant_ = linear_plant(problem);
    start_ = made_ = Plan<M>(problem);
  }

  SolveReport solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept override {
    const auto begun = Deadline::Clock::now();
    start_from(problem, plan);
    const SolveReport relaxed = relaxed_->solve(as_planned(problem), relaxed_plan_, deadline);
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
    relaxed_->anticipate(as_planned(expected), relaxed_plan_);
  }
  bool time_phases(PhaseTimes* into) noexcept override { return relaxed_->time_phases(into); }

  const RelaxedPlan<M>& relaxed_plan() const { return relaxed_plan_; }

 private:
  std::unique_ptr<Modulator> make_modulator(const Problem<M>& problem) const {
    switch (settings_.modulation) {
      case Modulation::delta_sigma:
        return std::make_unique<DeltaSigma>(1, settings_.edge_price);
      case Modulation::delta_sigma_2:
        return std::make_unique<DeltaSigma>(2, settings_.edge_price);
      case Modulation::dynamic_quantiser:
        return std::make_unique<DynamicQuantiser>(linear_plant(problem), settings_.edge_price);
      case Modulation::pulse_width:
        break;
    }
    return std::make_unique<PulseWidth>(settings_.edge_price);
  }

  /// The problem that the relaxed inputs are planned for, after start_from().
  const Problem<M>& as_planned(const Problem<M>& problem) noexcept {
    if (!ahead_) return problem;
    ahead_->copy_conditions(problem);
    linearise(problem, first_commanded(problem), relaxed_plan_.continuous.front(), plant_);
    StateOf<M> first{}, second{};  // B s, B (t - s)
    for (std::size_t i = 0; i < M::state_size; ++i)
      for (std::size_t c = 0; c < plant_.switches; ++c) {
        first[i] += push(plant_, i, c) * begin_.owed[c];
        second[i] += push(plant_, i, c) * (begin_.owed_sum[c] - begin_.owed[c]);
      }
    for (std::size_t i = 0; i < M::state_size; ++i) {
      ahead_->initial[i] += first[i] - second[i];
      for (std::size_t k = 0; k < M::state_size; ++k) ahead_->initial[i] += plant_.a[i * M::state_size + k] * second[k];
    }
    return *ahead_;
  }
  SwitchStates<double> first_commanded(const Problem<M>& problem) const noexcept {
    return commanded_states<double>(problem.modes, relaxed_plan_.row(0));
  }

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
    begin_ = {};
    if (start_.relaxation.known) begin_ = {plan.relaxation.owed.front(), plan.relaxation.owed_sum.front()};
    relax_plan(problem, grid_, start_, relaxed_plan_);
  }

  /// The relaxed plan cut into pulses, judged by the exact physics.
  Status cut(const Problem<M>& problem, SolveReport& report) noexcept {
    keep_relaxation(problem, grid_, relaxed_plan_, made_);
    std::ranges::copy(made_.relaxation.weights, weights_.weight.begin());
    if (!normalise(weights_)) return Status::numerical_failure;
    std::ranges::copy(weights_.weight, made_.relaxation.weights.begin());
    if (LinearPlant* plant = modulator_->plant())
      linearise(problem, first_commanded(problem), relaxed_plan_.continuous.front(), *plant);
    modulator_->round(problem.modes, problem.lines, relaxed_plan_.weights, begin_, made_.modes, made_.relaxation.owed,
                      made_.relaxation.owed_sum);
    report = evaluate(problem, made_);
    return report.status;
  }

  RelaxAndPulseSettings settings_;
  std::unique_ptr<RelaxedSolver<M>> relaxed_;
  RelaxedGrid grid_;
  RelaxedPlan<M> relaxed_plan_;
  ModeWeights weights_;  // a step each: checks and normalises
  std::unique_ptr<Modulator> modulator_;
  ModulatorState begin_;             // as the problem begins
  std::optional<Problem<M>> ahead_;  // with what is owed made up for
  LinearPlant plant_;
  Plan<M> start_, made_;
};

}  // namespace solenoid
