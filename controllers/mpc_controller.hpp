#pragma once

#include "controllers/any_solver.hpp"
#include "controllers/controller_shell.hpp"
#include "controllers/estimators/forecast.hpp"
#include "controllers/integral_offset.hpp"
#include "controllers/planned_inputs.hpp"
#include "controllers/switch_health.hpp"
#include "core/mpc/solver.hpp"
#include "core/rt/deferred_solver.hpp"
#include "core/system/description.hpp"

#include <algorithm>
#include <memory>
#include <optional>

namespace solenoid {

/// Predictive control of the switches: every variant with a Solver, of any system. A Decider of ControllerShell.
///
///     each T_s    integral offset; the command of the plan in force, tick by tick; continuous inputs
///     each T_sp   problem from the estimate, the commands in flight and the reference ahead; solve; the plan takes
///                 effect latency_ticks later: the problem starts from the state forecast to that moment
///     the tick before   a solver that anticipates gets the problem as it is expected
///
/// A DeferredSolver is posted the problem and asked each tick; its plan takes effect on arrival, or latency_ticks after
/// the problem was posed if that is later. While no newer plan can be applied (a solve failed, or is late), the last
/// one goes on with its own later blocks; decision.rung and plan_age say so.
///
/// Inputs makes the continuous inputs of a plan's share and of what the system has beside it (planned_inputs.hpp).
template <HybridModel Model, class Inputs = PlannedInputs<Model>>
class MpcController {
 public:
  /// What predictive control is made of.
  struct Parts {
    Problem<Model> problem;  ///< nominal model, modes, horizon, cost; state and reference are filled in each period
    AnySolverPtr solver;
    IntegralSettings integral;
    std::optional<double> deadline_ms;
    int latency_ticks = 0;  ///< from sampling to the plan's taking effect, at most a period
    int ticks_per_period = 5;
    std::vector<OutputSource> outputs{};  ///< of the model: what of the reference each one is to follow
    Inputs inputs{};
    std::vector<SpareModes> spares{};  ///< the solver is prepared for, too (solver_bank.hpp)
  };

  /// Prepares the solver; may throw.
  explicit MpcController(Parts parts)
      : parts_(std::move(parts)),
        deferred_(dynamic_cast<DeferredSolver*>(parts_.solver.get())),
        tick_s_(parts_.problem.horizon.dt_s),
        ticks_per_period_(parts_.ticks_per_period),
        fresh_ticks_(ticks_per_period_ + (deferred_ ? std::max(0, ticks_per_period_ - parts_.latency_ticks) : 0)),
        timing_(parts_.problem.modes, tick_s_),
        plan_(parts_.problem),
        expected_plan_(plan_),
        current_{plan_},
        next_{plan_},
        plan_tick_(-ticks_per_period_) {
    offset_.fill(IntegralOffset(parts_.integral));
    parts_.solver->prepare(parts_.problem);
  }

  void believe(const EstimateDetail& found) noexcept { parts_.inputs.believe(found, parts_.problem.model); }

  void decide(const Moment& now, Decision& d) noexcept {
    update_offsets(d);
    take_up_due_plan(now.tick);
    if (deferred_) collect(now.tick, d);
    if (now.tick / ticks_per_period_ != slot_) plan(now, d);
    d.command.switches = switches(now, d);
    input_ = parts_.inputs.apply(model(), d.reference, first<Model::state_size>(d.estimate), planned_);
    d.command.continuous = padded<max_continuous>(commanded(parts_.inputs, input_));
  }

  /// In the last tick of a slot: the next problem but for what will be measured.
  void look_ahead(const Moment& now, const Decision& d, SwitchPattern in_effect) noexcept {
    const std::int64_t slot_begin = now.tick + 1;
    if (slot_begin % ticks_per_period_ != 0 || !parts_.solver->anticipates()) return;
    SwitchedOf<Model> switched;
    std::ranges::copy(parts_.problem.modes.point(in_effect), switched.begin());
    const auto then = model().template step<double>(first<Model::state_size>(d.estimate), switched, input_, tick_s_);
    pose(now, {slot_begin, now.time_s + tick_s_, then, d.offset});
    expected_plan_ = plan_;
    shift_plan(parts_.problem.horizon, steps_since(plan_tick_, slot_begin), expected_plan_);
    parts_.solver->anticipate(parts_.problem, expected_plan_);
  }

  void restart(std::int64_t tick) noexcept {
    offset_.fill(IntegralOffset(parts_.integral));
    current_.valid = next_.valid = false;
    oldest_ = tick;
    slot_ = -1;
  }

  /// Commands the modes of spare set k from now on. Plans go on, a mode that is none any more being replaced by what is left
  /// of it; what a solver is still at is not taken, and the next problem is posed in this tick. Once. No allocation.
  void use(std::size_t k, std::int64_t tick) noexcept {
    SpareModes& spare = parts_.spares[k];
    const SwitchPattern failed = SwitchPattern{1} << spare.failed.c;
    std::swap(parts_.problem.modes, *spare.left);
    parts_.problem.mode_set = static_cast<int>(k) + 1;
    timing_ = SwitchTiming(parts_.problem.modes, tick_s_);
    for (AnyPlan* plan : {static_cast<AnyPlan*>(&plan_), static_cast<AnyPlan*>(&expected_plan_),
                          static_cast<AnyPlan*>(&current_.plan), static_cast<AnyPlan*>(&next_.plan)})
      rename_modes(*spare.left, parts_.problem.modes, failed, *plan);
    oldest_ = tick;
    slot_ = -1;
  }

 private:
  /// Numbers the plan's modes as the new set does.
  static void rename_modes(const ModeSet& from, const ModeSet& to, SwitchPattern failed, AnyPlan& plan) noexcept {
    for (int& mode : plan.modes) {
      const SwitchPattern wanted = mode >= 0 && mode < from.size() ? from.pattern(mode) : to.safe_pattern();
      mode = to.find(wanted);
      if (mode < 0) mode = to.find(wanted & ~failed);
      if (mode < 0) mode = to.find(to.safe_pattern());
    }
    plan.relaxation.known = false;
    plan.relaxation.weights.resize(plan.modes.size() * static_cast<std::size_t>(to.size()));  // no more than there were
  }

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
    StateOf<Model> state{};
    AxisValues offset{};
  };

  static int steps_since(std::int64_t then, std::int64_t now) noexcept {
    return static_cast<int>(std::min<std::int64_t>(now - then, 1000));
  }

  const Model& model() const noexcept { return parts_.problem.model; }

  /// The integral action works on the axes themselves, not on their rates.
  void update_offsets(Decision& d) noexcept {
    const OutputOf<Model> output = model().template output<double>(first<Model::state_size>(d.estimate));
    for (std::size_t i = 0; i < parts_.outputs.size(); ++i)
      if (const std::size_t axis = parts_.outputs[i].axis; parts_.outputs[i].derivative == 0)
        d.offset[axis] = offset_[axis].update(d.reference.axis[axis].value - output[i]);
  }

  void plan(const Moment& now, Decision& d) noexcept {
    slot_ = now.tick / ticks_per_period_;
    const std::int64_t begin = pose(now, {now.tick, now.time_s, first<Model::state_size>(d.estimate), d.offset});
    shift_plan(parts_.problem.horizon, steps_since(plan_tick_, now.tick), plan_);
    plan_tick_ = now.tick;
    if (deferred_) {
      deferred_->post(now.tick, parts_.problem, plan_,
                      parts_.deadline_ms ? 1e-3 * *parts_.deadline_ms : 0.8 * tick_s_ * ticks_per_period_);
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
    const std::int64_t slot_begin = at.tick / ticks_per_period_ * ticks_per_period_;
    const std::int64_t begin = std::max(at.tick, slot_begin + parts_.latency_ticks);
    const int lead = static_cast<int>(begin - at.tick);
    problem.lines = now.in_flight.lines();
    problem.begins = begin;
    const auto commanded = [&](int j) { return planned_switches(at.tick + j, problem.lines.commanded()); };
    const auto input = [&](int j, const StateOf<Model>& x) {
      return parts_.inputs.apply(problem.model, now.reference.at(at.time_s + j * tick_s_), x, planned_);
    };
    problem.initial = nearest_valid(problem.model, forecast(problem.model, problem.modes, timing_, at.state,
                                                            problem.lines, lead, tick_s_, commanded, input));
    pose_reference(now.reference, at, lead);
    return begin;
  }

  /// The reference ahead, shifted by the integral's offset, for a problem that begins `lead` ticks after the sample.
  void pose_reference(const RestartableReference& reference, const Sampled& at, int lead) noexcept {
    Problem<Model>& problem = parts_.problem;
    ReferenceSample desired;
    const auto advance = [&](std::size_t step) {
      reference.at(at.time_s + (lead + static_cast<double>(step)) * tick_s_, desired);
    };
    if constexpr (HasFeedback<Model>) advance(0);
    for (std::size_t j = 0; j < problem.reference.size(); ++j) {
      if constexpr (HasFeedback<Model>) problem.setpoint[j] = outputs(desired, AxisValues{});
      advance(j + 1);
      problem.reference[j] = outputs(desired, at.offset);
    }
  }

  /// What the model's outputs are to be.
  OutputOf<Model> outputs(const ReferenceSample& desired, const AxisValues& offset) const noexcept {
    OutputOf<Model> wanted{};
    for (std::size_t i = 0; i < parts_.outputs.size(); ++i) {
      const OutputSource& output = parts_.outputs[i];
      wanted[i] = desired.axis[output.axis].derivative(output.derivative);
      if (output.derivative == 0) wanted[i] += offset[output.axis];
    }
    return wanted;
  }

  /// What the plans at hand will command in a tick to come; without one the switches keep their command.
  SwitchPattern planned_switches(std::int64_t tick, SwitchPattern in_force) const noexcept {
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
    const auto& plan = static_cast<const Plan<Model>&>(*done->plan);
    if (!usable(d.report.status) || !sound(plan)) return;
    plan_ = plan;
    plan_tick_ = done->ticket;
    const auto slot_begin = done->ticket / ticks_per_period_ * ticks_per_period_;
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

  /// The switches of the plan in force, and its share of the continuous inputs; without one they keep their command.
  SwitchPattern switches(const Moment& now, Decision& d) noexcept {
    constexpr std::int64_t oldest_told = 1 << 20;
    if (!current_.valid) {
      d.plan_age = static_cast<int>(std::min(now.tick - oldest_, oldest_told));
      d.planned = d.plan_age < fresh_ticks_;  // the first plan is still on its way
      planned_ = {};
      return now.in_flight.lines().commanded();
    }
    d.plan_age = static_cast<int>(std::min(now.tick - current_.begin, oldest_told));
    d.rung = d.plan_age < fresh_ticks_ ? Rung::fresh : Rung::shifted;
    const std::size_t b = current_.block(now.tick, parts_.problem.horizon.blocks);
    planned_ = current_.plan.continuous[b];
    return allowed(parts_.problem.modes.pattern(current_.plan.modes[b]), now.in_flight.lines());
  }

  /// What a plan wants, once the switches' limits let it: one that arrives late, is taken up again from a lower rung or is what is
  /// left of another was made for other commands than were given. Till then they keep their command.
  SwitchPattern allowed(SwitchPattern wanted, const DelayLines& lines) const noexcept {
    const bool kept = lines.may_command(wanted, timing_) || parts_.problem.modes.find(lines.commanded()) < 0;
    return kept ? wanted : lines.commanded();
  }

  Parts parts_;
  DeferredSolver* deferred_;  // parts_.solver, if it is one
  double tick_s_;
  int ticks_per_period_, fresh_ticks_;
  SwitchTiming timing_;
  Plan<Model> plan_;  // the newest, and the next solve's warm start
  Plan<Model> expected_plan_;
  Active current_, next_;
  std::array<IntegralOffset, max_axes> offset_{};
  ContinuousOf<Model> planned_{};  // the plan's own share of the continuous inputs
  ContinuousOf<Model> input_{};    // the model's input in the tick at hand
  std::int64_t slot_ = -1, plan_tick_, oldest_ = 0;
};

}  // namespace solenoid
