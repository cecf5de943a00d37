#include "controllers/ladder/fallback_ladder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr int most_predicted_ticks = 50;  // a longer gap ends in SAFE, and the filter starts anew

bool finite(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

PlausibilitySettings at_tick(PlausibilitySettings settings, double tick_s) {
  settings.tick_s = tick_s;
  return settings;
}

}  // namespace

void require_complete(const LadderSettings& settings, const SystemDescription& system) {
  const std::size_t channels = system.channels.size();
  const auto refuse = [&](const char* what, std::size_t count) {
    throw std::invalid_argument(fmt::format("ladder: {} of {} channels (allowed: one for each of the {}'s {})", what,
                                            count, system.name, channels));
  };
  if (settings.plausibility.channels.size() != channels) refuse("bounds", settings.plausibility.channels.size());
  if (!settings.limits.empty() && settings.limits.size() != channels) refuse("limits", settings.limits.size());
}

FallbackLadder::FallbackLadder(Parts parts)
    : controller_(std::move(parts.controller)),
      guard_(std::move(parts.guard)),
      modes_(std::move(parts.modes)),
      timing_(parts.timing),
      switch_timing_(modes_, timing_.tick_s),
      reference_(std::move(parts.reference)),
      axis_channels_(std::move(parts.axis_channels)),
      settings_(std::move(parts.settings)),
      plausibility_(at_tick(settings_.plausibility, timing_.tick_s)) {}

Decision FallbackLadder::step(const Measurement& measured) noexcept {
  const double time_s = measured.time_s;
  const auto slot = static_cast<std::int64_t>(std::floor(time_s / timing_.period_s() + 1e-6));
  slot_begins_ = slot != slot_;
  slot_ = slot;
  catch_up(time_s);
  // What a model with sound switches expects is no measure while a switch is suspected.
  const bool doubt = controller_->doubts_switches();
  const Plausibility::Verdict verdict = plausibility_.check(measured, doubt ? ChannelValues{} : expected_change(),
                                                            doubt ? ChannelValues{} : guard_->innovations());
  watched_ = guard_->watch(verdict.measured);
  Decision d = controller_->step(verdict.measured);
  take_what_is_left(d);
  if (!finite(d.estimate)) d.estimate = watched_;
  look_for_danger(measured, verdict, d);
  const Rung rung = choose(d, verdict, time_s);
  command(rung, time_s, d);
  count(rung, slot_begins_);
  count_infeasible(d, time_s);
  d.rung = rung;
  d.safe_causes = causes_;
  consider_rearm(measured);
  decided_ = d.command;
  last_time_s_ = time_s;
  started_ = true;
  return d;
}

/// Ticks that were skipped passed under the last command, unmeasured.
void FallbackLadder::catch_up(double time_s) noexcept {
  if (!started_) return;
  const auto missed = std::llround((time_s - last_time_s_) / timing_.tick_s) - 1;
  if (missed < 1) return;
  plausibility_.skip(static_cast<int>(std::min<long long>(missed, most_predicted_ticks)));
  Measurement unknown;
  unknown.value.fill(std::numeric_limits<double>::quiet_NaN());
  for (long long k = 0; k < std::min<long long>(missed, most_predicted_ticks); ++k) {
    guard_->watch(unknown);
    assume(last_left_);
  }
}

/// In the tick in which the controller does without a switch, everything here does.
void FallbackLadder::take_what_is_left(const Decision& d) noexcept {
  if (controller_->left() == left_) return;
  left_ = controller_->left();
  switch_timing_ = SwitchTiming(*left_, timing_.tick_s);
  guard_->use(static_cast<std::size_t>(d.mode_set - 1));
  held_mode_ = left_->safe_pattern();
  last_ = Rung::fresh;  // a held mode is searched anew
}

void FallbackLadder::assume(const Command& command) noexcept {
  last_left_ = command;
  lines_.command(command.switches, switch_timing_);
  guard_->applied(modes().point(lines_.effective()), command.continuous);
  lines_.advance(1);
}

void FallbackLadder::applied(const Command& command) noexcept {
  // The exit replaces by the safe value what it refuses: a command that was no number or no allowed pattern.
  refused_ = !finite(decided_.continuous) || modes().find(decided_.switches) < 0;
  controller_->applied(command);
  assume(command);
}

void FallbackLadder::restart(double time_s, const AxisValues& from) noexcept {
  reference_.restart(time_s, from);
  controller_->restart(time_s, from);
}

/// Of each channel, by the switches in effect, per tick.
ChannelValues FallbackLadder::expected_change() const noexcept {
  if (!started_ || !finite(watched_)) return {};
  return guard_->expected_change(watched_, modes().point(lines_.effective()));
}

AxisValues FallbackLadder::measured_axes(const Measurement& measured) const noexcept {
  AxisValues values{};
  for (std::size_t a = 0; a < axis_channels_.size(); ++a) values[a] = measured.value[axis_channels_[a]];
  return values;
}

void FallbackLadder::look_for_danger(const Measurement& measured, const Plausibility::Verdict& verdict,
                                     Decision& d) noexcept {
  FaultSet found, beyond;
  for (std::size_t i = 0; i < settings_.limits.size(); ++i) {
    const double value = verdict.measured.value[i];
    const ChannelLimits& limits = settings_.limits[i];
    if (std::isfinite(value) && (value < limits.low || value > limits.high)) beyond.add(limits.fault);
  }
  if (started_ && measured.time_s - last_time_s_ > (settings_.longest_gap_ticks + 0.5) * timing_.tick_s)
    found.add(Fault::tick_gap);
  if (started_ && measured.node_was_safe) found.add(Fault::node_safe);
  if (refused_) found.add(Fault::command_refused);
  if (const int why = stop_.load(std::memory_order_relaxed)) found.add(static_cast<Fault>(why - 1));
  if (d.faults.has(Fault::switches_lost)) found.add(Fault::switches_lost);
  d.faults |= verdict.seen;
  d.faults |= verdict.failed;
  d.faults |= found;
  d.faults |= beyond;
  FaultSet causes = found;
  const bool ended = causes_.has(Fault::stopped) || causes_.has(Fault::aborted);
  if (!ended) {  // where the plant goes afterwards is no failure of the run
    causes |= beyond;
    for (const std::size_t channel : settings_.needed_to_stop)
      if (verdict.failed.any(channel)) causes |= verdict.failed;
  }
  if (!causes.empty()) latch(causes, measured.time_s);
  sound_ticks_ = verdict.seen.empty() && found.empty() && beyond.empty() ? sound_ticks_ + 1 : 0;
}

void FallbackLadder::latch(FaultSet causes, double time_s) noexcept {
  if (!safe_) {
    safe_ = true;
    safe_since_s_ = time_s;
    ++counts_.safe_entries;
  }
  causes_ |= causes;
}

/// Takes effect with the next tick: this one's commands were decided in SAFE.
void FallbackLadder::consider_rearm(const Measurement& measured) noexcept {
  if (!rearm_.exchange(false, std::memory_order_relaxed) || !safe_) return;
  if (sound_ticks_ < settings_.rearm_sound_ticks || !guard_->at_rest(watched_) ||
      stop_.load(std::memory_order_relaxed) != 0) {
    ++counts_.refused_rearms;
    return;
  }
  // A failed sensor reads sound again; it starts anew, as do the filter and the task.
  plausibility_.reset();
  guard_->reset();
  safe_ = false;
  causes_ = {};
  held_slots_ = backup_slots_ = 0;
  ++counts_.rearms;
  restart(measured.time_s, measured_axes(measured));
}

Rung FallbackLadder::choose(const Decision& d, const Plausibility::Verdict& verdict, double time_s) noexcept {
  if (safe_) return Rung::safe;
  for (const std::size_t channel : settings_.needed_to_plan)
    if (verdict.failed.any(channel)) return below_plans(time_s, verdict.failed);
  const bool soon_enough = d.plan_age < (settings_.shifted_slots + 1) * timing_.ticks_per_period;
  if (d.planned && (d.rung == Rung::fresh || soon_enough)) return d.rung;
  return below_plans(time_s, {});
}

/// Without the channels of `failed` nothing can be said about the switches.
Rung FallbackLadder::below_plans(double time_s, FaultSet failed) noexcept {
  if (failed.empty() && held_slots_ < settings_.held_slots) return Rung::held;
  if (guard_->has_backup_law() && backup_slots_ < settings_.backup_slots) return Rung::backup;
  FaultSet causes = failed;
  if (failed.empty()) causes.add(Fault::no_plan);
  latch(causes, time_s);
  return Rung::safe;
}

void FallbackLadder::command(Rung rung, double time_s, Decision& d) noexcept {
  switch (rung) {
    case Rung::fresh:
    case Rung::shifted:
      return;
    case Rung::held:
      if (slot_begins_ || last_ != Rung::held) held_mode_ = guard_->held_mode(d.estimate, lines_, reference_, time_s);
      d.command.switches = held_mode_;
      d.command.continuous = guard_->held_inputs(d.command.continuous);
      return;
    case Rung::backup:
      d.command = {modes().safe_pattern(), guard_->backup_law(d.reference, watched_)};
      return;
    case Rung::safe:
      break;
  }
  d.command = {modes().safe_pattern(), {}};
  if (time_s - safe_since_s_ < settings_.lowering_s && finite(watched_) && !refused_ &&
      !causes_.has(Fault::command_refused))
    d.command.continuous = guard_->brake(watched_);
}

void FallbackLadder::count_infeasible(const Decision& d, double time_s) noexcept {
  if (!d.solved || d.report.status != Status::infeasible || counts_.infeasible++ > 0) return;
  counts_.first_infeasible_s = time_s;
  counts_.first_broken = d.report.broken;
}

void FallbackLadder::count(Rung rung, bool slot_begins) noexcept {
  last_ = rung;
  if (!slot_begins) return;
  ++counts_.slots[static_cast<std::size_t>(rung)];
  held_slots_ = rung == Rung::fresh ? 0 : held_slots_ + (rung == Rung::held);
  backup_slots_ = rung == Rung::fresh ? 0 : backup_slots_ + (rung == Rung::backup);
}

}  // namespace solenoid
