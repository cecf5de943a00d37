#pragma once

#include "controllers/controller_shell.hpp"
#include "controllers/estimators/forecast.hpp"
#include "controllers/integral_offset.hpp"
#include "controllers/timing.hpp"
#include "core/mpc/solver.hpp"
#include "core/rt/deferred_solver.hpp"

#include <algorithm>
#include <memory>
#include <optional>

namespace solenoid {

/// Predictive control of the valves beside a motor law: every variant with a Solver. A Decider of ControllerShell.
///
///     each T_s    integral offset; the command of the plan in force, tick by tick; motor force
///     each T_sp   problem from the estimate, the commands in flight and the reference ahead; solve; the plan takes
///                 effect latency_ticks later: the problem starts from the state forecast to that moment
///     the tick before   a solver that anticipates gets the problem as it is expected
///
/// A DeferredSolver is posted the problem and asked each tick; its plan takes effect on arrival, or latency_ticks after
/// the problem was posed if that is later. While no newer plan can be applied (a solve failed, or is late), the last
/// one goes on with its own later blocks; decision.rung and plan_age say so.
template <HybridModel Model>
class MpcController {
 public:
  /// What predictive control is made of.
  struct Parts {
    Problem<Model> problem;  ///< nominal model, modes, horizon, cost; state and reference are filled in each period
    std::unique_ptr<Solver<Model>> solver;
    IntegralSettings integral;
    std::optional<double> deadline_ms;
    int latency_ticks = 0;  ///< from sampling to the plan's taking effect, at most a period
  };

  /// Prepares the solver; may throw.
  explicit MpcController(Parts parts)
      : parts_(std::move(parts)),
        deferred_(dynamic_cast<DeferredSolver<Model>*>(parts_.solver.get())),
        fresh_ticks_(ticks_per_period + (deferred_ ? std::max(0, ticks_per_period - parts_.latency_ticks) : 0)),
        timing_(parts_.problem.modes, tick_s),
        plan_(parts_.problem),
        expected_plan_(plan_),
        current_{plan_},
        next_{plan_},
        offset_(parts_.integral) {
    parts_.solver->prepare(parts_.problem);
  }

  void believe(double payload_kg, double external_force_n) noexcept {
    parts_.problem.model.set_load(payload_kg, external_force_n);
  }
  double payload_kg() const noexcept { return parts_.problem.model.parameters().payload_mass_kg; }

  void decide(const Moment& now, Decision& d) noexcept {
    d.offset_m = offset_.update(d.reference.position - d.estimate[position]);
    take_up_due_plan(now.tick);
    if (deferred_) collect(now.tick, d);
    if (now.tick / ticks_per_period != slot_) plan_valves(now, d);
    d.command.coils = coils(now, d);
    d.command.motor_force_n = motor_force(now.motor, d.reference, d.estimate);
  }

  /// In the last tick of a slot: the next problem but for what will be measured.
  void look_ahead(const Moment& now, const Decision& d, SwitchPattern in_effect) noexcept {
    const std::int64_t slot_begin = now.tick + 1;
    if (slot_begin % ticks_per_period != 0 || !parts_.solver->anticipates()) return;
    const Model& model = parts_.problem.model;
    SwitchedOf<Model> switched;
    std::ranges::copy(parts_.problem.modes.point(in_effect), switched.begin());
    const auto then = model.template step<double>(d.estimate, switched, {d.command.motor_force_n}, tick_s);
    pose(now, {slot_begin, now.time_s + tick_s, then, d.offset_m});
    expected_plan_ = plan_;
    shift_plan(parts_.problem.horizon, steps_since(plan_tick_, slot_begin), expected_plan_);
    parts_.solver->anticipate(parts_.problem, expected_plan_);
  }

  void restart(std::int64_t tick) noexcept {
    offset_ = IntegralOffset(parts_.integral);
    current_.valid = next_.valid = false;
    oldest_ = tick;
    slot_ = -1;
  }

 private:
  /// A plan in force or to come.
  struct Active {
    Plan<Model> plan;
    std::int64_t begin = 0;
    bool valid = false;

    std::size_t block(std::int64_t tick, const std::vector<int>& blocks) const noexcept {
      std::size_t b = 0;
      for (std::int64_t end = begin + blocks[0]; tick >= end && b + 1 < blocks.size();) end += blocks[++b];
      return b;
    }
  };
  /// Where a problem begins: at a sample, or at what is expected of the next.
  struct Sampled {
    std::int64_t tick = 0;
    double time_s = 0.0;
    ActuatorState state{};
    double offset_m = 0.0;
  };

  static int steps_since(std::int64_t then, std::int64_t now) noexcept {
    return static_cast<int>(std::min<std::int64_t>(now - then, 1000));
  }

  /// A joint plan's share adds to the law, saturated together.
  double motor_force(const MotorLaw& motor, const ReferenceSample& desired, const StateOf<Model>& x) const noexcept {
    const Model& model = parts_.problem.model;
    if (planned_n_ == 0.0) return law_force(motor, desired, x);
    if constexpr (HasFeedback<Model>) {
      const auto law = model.template feedback<double>(x, {desired.position, desired.velocity});
      return model.template saturated_motor_force<double>(law[0] + planned_n_);
    }
    return model.template saturated_motor_force<double>(law_force(motor, desired, x) + planned_n_);
  }

  void plan_valves(const Moment& now, Decision& d) noexcept {
    slot_ = now.tick / ticks_per_period;
    const std::int64_t begin = pose(now, {now.tick, now.time_s, d.estimate, d.offset_m});
    shift_plan(parts_.problem.horizon, steps_since(plan_tick_, now.tick), plan_);
    plan_tick_ = now.tick;
    if (deferred_) {
      deferred_->post(now.tick, parts_.problem, plan_,
                      parts_.deadline_ms ? 1e-3 * *parts_.deadline_ms : 0.8 * period_s);
      return;
    }
    d.report = parts_.solver->solve(parts_.problem, plan_, deadline());
    d.solved = true;
    if (usable(d.report.status)) adopt(now.tick, plan_, begin);
  }

  /// The end of a solve's budget, counted from now.
  Deadline deadline() const noexcept {
    if (!parts_.deadline_ms) return Deadline::never();
    return Deadline::after(std::chrono::nanoseconds(static_cast<std::int64_t>(*parts_.deadline_ms * 1e6)));
  }

  /// The problem of a sample; returns the tick in which its plan takes effect.
  std::int64_t pose(const Moment& now, const Sampled& at) noexcept {
    Problem<Model>& problem = parts_.problem;
    const std::int64_t slot_begin = at.tick / ticks_per_period * ticks_per_period;
    const std::int64_t begin = std::max(at.tick, slot_begin + parts_.latency_ticks);
    const int lead = static_cast<int>(begin - at.tick);
    problem.lines = now.in_flight.lines();
    const auto commanded = [&](int j) { return planned_coils(at.tick + j, problem.lines.commanded()); };
    const auto motor = [&](int j, const StateOf<Model>& x) {
      return ContinuousOf<Model>{motor_force(now.motor, now.reference.at(at.time_s + j * tick_s), x)};
    };
    problem.initial = problem.model.nearest_valid(
        forecast(problem.model, problem.modes, timing_, at.state, problem.lines, lead, tick_s, commanded, motor));
    pose_reference(now.reference, at, lead);
    return begin;
  }

  /// The reference ahead, shifted by the integral's offset, for a problem that begins `lead` ticks after the sample.
  void pose_reference(const RestartableReference& reference, const Sampled& at, int lead) noexcept {
    Problem<Model>& problem = parts_.problem;
    for (std::size_t j = 0; j < problem.reference.size(); ++j) {
      const double step = lead + static_cast<double>(j);
      const ReferenceSample end = reference.at(at.time_s + (step + 1.0) * tick_s);
      problem.reference[j] = {end.position + at.offset_m, end.velocity};
      if constexpr (HasFeedback<Model>) {
        const ReferenceSample begin = reference.at(at.time_s + step * tick_s);
        problem.setpoint[j] = {begin.position, begin.velocity};
      }
    }
  }

  /// What the plans at hand will command in a tick to come; without one the coils keep their command.
  SwitchPattern planned_coils(std::int64_t tick, SwitchPattern in_force) const noexcept {
    const Active& active = next_.valid && next_.begin <= tick ? next_ : current_;
    if (!active.valid) return in_force;
    return parts_.problem.modes.pattern(active.plan.modes[active.block(tick, parts_.problem.horizon.blocks)]);
  }

  void collect(std::int64_t tick, Decision& d) noexcept {
    const auto* done = deferred_->collect();
    if (!done || done->ticket < oldest_) return;
    d.report = done->report;
    d.solved = true;
    d.ticket = done->ticket;
    if (!usable(d.report.status) || !sound(done->plan)) return;
    plan_ = done->plan;
    plan_tick_ = done->ticket;
    const auto slot_begin = done->ticket / ticks_per_period * ticks_per_period;
    adopt(tick, plan_, std::max(done->ticket, slot_begin + parts_.latency_ticks));
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

  void adopt(std::int64_t tick, const Plan<Model>& plan, std::int64_t begin) noexcept {
    Active& slot = begin <= tick ? current_ : next_;
    slot.plan = plan;
    slot.begin = begin;
    slot.valid = true;
  }

  /// Before the next plan is made: with a latency of a whole period both fall on the same tick.
  void take_up_due_plan(std::int64_t tick) noexcept {
    if (!next_.valid || next_.begin > tick) return;
    std::swap(current_, next_);
    next_.valid = false;
  }

  /// The coils of the plan in force, and its share of the motor force; without one coils keep their command.
  SwitchPattern coils(const Moment& now, Decision& d) noexcept {
    constexpr std::int64_t oldest_told = 1 << 20;
    if (!current_.valid) {
      d.plan_age = static_cast<int>(std::min(now.tick - oldest_, oldest_told));
      d.planned = d.plan_age < fresh_ticks_;  // the first plan is still on its way
      planned_n_ = 0.0;
      return now.in_flight.lines().commanded();
    }
    d.plan_age = static_cast<int>(std::min(now.tick - current_.begin, oldest_told));
    d.rung = d.plan_age < fresh_ticks_ ? Rung::fresh : Rung::shifted;
    const std::size_t b = current_.block(now.tick, parts_.problem.horizon.blocks);
    planned_n_ = current_.plan.continuous[b][0];
    return parts_.problem.modes.pattern(current_.plan.modes[b]);
  }

  Parts parts_;
  DeferredSolver<Model>* deferred_;  // parts_.solver, if it is one
  int fresh_ticks_;
  SwitchTiming timing_;
  Plan<Model> plan_;  // the newest, and the next solve's warm start
  Plan<Model> expected_plan_;
  Active current_, next_;
  IntegralOffset offset_;
  double planned_n_ = 0.0;  // a joint plan's motor force beside the law
  std::int64_t slot_ = -1, plan_tick_ = -ticks_per_period, oldest_ = 0;
};

}  // namespace solenoid
