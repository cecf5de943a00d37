#pragma once

#include "controllers/commands_in_flight.hpp"
#include "controllers/estimators/estimator.hpp"
#include "controllers/estimators/forecast.hpp"
#include "controllers/integral_offset.hpp"
#include "controllers/motor_laws.hpp"
#include "controllers/posing.hpp"
#include "controllers/variant.hpp"
#include "core/mpc/solver.hpp"
#include "core/reference/restartable.hpp"
#include "core/rt/controller.hpp"
#include "core/rt/deferred_solver.hpp"

#include <algorithm>
#include <memory>
#include <variant>

namespace solenoid {

/// Predictive control of the valves beside a motor law: DMPC, DMPC+I and every variant whose modes come from a Solver.
///
///     each T_s    estimate, integral offset, motor force
///     each T_sp   problem from the estimate, the commands in flight and the reference ahead; solve; command the first
///                 mode, latency_ticks later: the problem starts from the state forecast to that moment
///
/// A DeferredSolver is posted the problem and asked each tick; its plan takes effect on arrival, or latency_ticks after
/// the problem was posed if that is later. While no newer plan can be applied (a solve failed, or is late), the last
/// one goes on with its own later blocks; decision.rung and plan_age say so.
template <HybridModel Model>
class MpcController final : public Controller {
 public:
  struct Parts {
    Problem<Model> problem;  ///< model believed, modes, horizon, cost; state and reference are filled in each period
    std::unique_ptr<Solver<Model>> solver;
    RestartableReference reference;
    IntegralSettings integral;
    MotorLaw motor;
    std::optional<double> deadline_ms;
    Estimator estimator;
    UseEstimate use_estimate;
    int latency_ticks = 0;  ///< from sampling to the plan's taking effect, at most a period
  };

  /// Prepares the solver; may throw.
  explicit MpcController(Parts parts)
      : parts_(std::move(parts)),
        deferred_(dynamic_cast<DeferredSolver<Model>*>(parts_.solver.get())),
        fresh_ticks_(ticks_per_period + (deferred_ ? std::max(0, ticks_per_period - parts_.latency_ticks) : 0)),
        in_flight_(parts_.problem.modes),
        plan_(parts_.problem),
        current_{plan_},
        next_{plan_},
        offset_(parts_.integral) {
    parts_.solver->prepare(parts_.problem);
  }

  Decision step(const Sensors& sensors) noexcept override {
    tick_ += in_flight_.catch_up(sensors, parts_.estimator);
    Decision d;
    d.reference = parts_.reference.at(sensors.time_s);
    take_estimate(sensors, parts_.use_estimate, parts_.estimator, parts_.problem.model, parts_.motor, d);
    d.offset_m = offset_.update(d.reference.position - d.estimate[position]);
    take_up_due_plan();
    if (deferred_) collect(d);
    if (tick_ / ticks_per_period != slot_) plan_valves(sensors.time_s, d);
    d.command.coils = coils(d);
    d.command.motor_force_n = motor_force(d.reference, d.estimate);
    in_flight_.take(d.command, parts_.estimator);
    ++tick_;
    return d;
  }

  void applied(const Command& command) noexcept override { in_flight_.correct(command, parts_.estimator); }

  void restart(double time_s, double position_m) noexcept override {
    parts_.reference.restart(time_s, position_m);
    offset_ = IntegralOffset(parts_.integral);
    current_.valid = next_.valid = false;
    oldest_ = tick_;
    slot_ = -1;
  }

 private:
  /// A plan in force or to come.
  struct Active {
    Plan<Model> plan;
    std::int64_t begin = 0;
    bool valid = false;
  };

  double motor_force(const ReferenceSample& desired, const StateOf<Model>& x) const noexcept {
    if constexpr (HasFeedback<Model>)
      if (planned_n_ != 0.0) {  // a joint plan's share on top of the law, saturated together
        const Model& model = parts_.problem.model;
        const auto law = model.template feedback<double>(x, {desired.position, desired.velocity});
        return model.template saturated_motor_force<double>(law[0] + planned_n_);
      }
    return std::visit([&](const auto& law) { return law.force(desired, x); }, parts_.motor);
  }

  void plan_valves(double time_s, Decision& d) noexcept {
    slot_ = tick_ / ticks_per_period;
    const auto begin = std::max(tick_, slot_ * ticks_per_period + parts_.latency_ticks);
    pose(time_s, static_cast<int>(begin - tick_), d);
    shift_plan(parts_.problem.horizon, static_cast<int>(std::min<std::int64_t>(tick_ - plan_tick_, 1000)), plan_);
    plan_tick_ = tick_;
    if (deferred_) {
      deferred_->post(tick_, parts_.problem, plan_, parts_.deadline_ms ? 1e-3 * *parts_.deadline_ms : 0.8 * period_s);
      return;
    }
    d.report = parts_.solver->solve(parts_.problem, plan_, deadline_in(parts_.deadline_ms));
    d.solved = true;
    if (usable(d.report.status)) adopt(plan_, begin);
  }

  /// The problem of this tick, whose plan takes effect `lead` ticks later.
  void pose(double time_s, int lead, const Decision& d) noexcept {
    Problem<Model>& problem = parts_.problem;
    problem.lines = in_flight_.lines();
    problem.initial = problem.model.nearest_valid(forecast(
        problem.model, problem.modes, d.estimate, problem.lines, lead, tick_s, [&](int j, const StateOf<Model>& x) {
          return ContinuousOf<Model>{motor_force(parts_.reference.at(time_s + j * tick_s), x)};
        }));
    pose_reference(parts_.reference, time_s, lead, d.offset_m, problem);
  }

  void collect(Decision& d) noexcept {
    const auto* done = deferred_->collect();
    if (!done || done->ticket < oldest_) return;
    d.report = done->report;
    d.solved = true;
    d.ticket = done->ticket;
    if (!usable(d.report.status) || !sound(done->plan)) return;
    plan_ = done->plan;
    plan_tick_ = done->ticket;
    const auto slot_begin = done->ticket / ticks_per_period * ticks_per_period;
    adopt(plan_, std::max(done->ticket, slot_begin + parts_.latency_ticks));
  }

  /// What comes from another thread is looked at before it moves anything.
  bool sound(const Plan<Model>& plan) const noexcept {
    const auto finite = [](const ContinuousOf<Model>& u) {
      return std::ranges::all_of(u, [](double v) { return std::isfinite(v); });
    };
    const int modes = parts_.problem.modes.size();
    return std::ranges::all_of(plan.modes, [modes](int m) { return m >= 0 && m < modes; }) &&
           std::ranges::all_of(plan.continuous, finite);
  }

  void adopt(const Plan<Model>& plan, std::int64_t begin) noexcept {
    Active& slot = begin <= tick_ ? current_ : next_;
    slot.plan = plan;
    slot.begin = begin;
    slot.valid = true;
  }

  /// Before the next plan is made: with a latency of a whole period both fall on the same tick.
  void take_up_due_plan() noexcept {
    if (!next_.valid || next_.begin > tick_) return;
    std::swap(current_, next_);
    next_.valid = false;
  }

  /// The coils of the plan in force, period by period, and its share of the motor force; without one coils keep their
  /// command.
  SwitchPattern coils(Decision& d) noexcept {
    if (!current_.valid) {
      d.plan_age = static_cast<int>(std::min<std::int64_t>(tick_ - oldest_, 1 << 20));
      d.planned = d.plan_age < fresh_ticks_;  // the first plan is still on its way
      planned_n_ = 0.0;
      return in_flight_.lines().commanded();
    }
    d.plan_age = static_cast<int>(std::min<std::int64_t>(tick_ - current_.begin, 1 << 20));
    d.rung = d.plan_age < fresh_ticks_ ? Rung::fresh : Rung::shifted;
    const std::vector<int>& blocks = parts_.problem.horizon.blocks;
    std::size_t b = 0;
    for (int end = blocks[0]; d.plan_age / ticks_per_period * ticks_per_period >= end && b + 1 < blocks.size();)
      end += blocks[++b];
    planned_n_ = current_.plan.continuous[b][0];
    return parts_.problem.modes.pattern(current_.plan.modes[b]);
  }

  Parts parts_;
  DeferredSolver<Model>* deferred_;  // parts_.solver, if it is one
  int fresh_ticks_;
  CommandsInFlight in_flight_;
  Plan<Model> plan_;  // the newest, and the next solve's warm start
  Active current_, next_;
  IntegralOffset offset_;
  double planned_n_ = 0.0;  // a joint plan's motor force beside the law
  std::int64_t tick_ = 0, slot_ = -1, plan_tick_ = -ticks_per_period, oldest_ = 0;
};

}  // namespace solenoid
