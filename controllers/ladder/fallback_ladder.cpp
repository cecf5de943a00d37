#include "controllers/ladder/fallback_ladder.hpp"

#include "controllers/systems/actuator/estimators/tuning.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace solenoid {
namespace {

constexpr int most_predicted_ticks = 50;  // a longer gap ends in SAFE, and the filter starts anew

bool finite(const ActuatorState& x) {
  return std::all_of(x.begin(), x.end(), [](double v) { return std::isfinite(v); });
}

}  // namespace

FallbackLadder::FallbackLadder(Parts parts)
    : controller_(std::move(parts.controller)),
      model_(parts.model),
      modes_(std::move(parts.modes)),
      timing_(modes_, tick_s),
      reference_(std::move(parts.reference)),
      settings_(parts.settings),
      plausibility_(parts.settings.plausibility, model_.parameters().atmospheric_pressure_pa,
                    model_.parameters().supply_pressure_pa),
      candidates_(model_, modes_),
      watch_(model_, EstimatorTuning()),
      new_watch_(watch_) {
  if (parts.motor) motor_.emplace(model_, *parts.motor);
}

Decision FallbackLadder::step(const Sensors& sensors) noexcept {
  const double time_s = sensors.time_s;
  const auto slot = static_cast<std::int64_t>(std::floor(time_s / period_s + 1e-6));
  slot_begins_ = slot != slot_;
  slot_ = slot;
  catch_up(time_s);
  const Plausibility::Verdict verdict = plausibility_.check(sensors, expected_pressure_change(), watch_.innovations());
  watched_ = watch_.update(verdict.sensors);
  Decision d = controller_->step(verdict.sensors);
  if (!finite(d.estimate)) d.estimate = watched_;
  look_for_danger(sensors, verdict, d);
  const Rung rung = choose(d, verdict, time_s);
  command(rung, time_s, d);
  count(rung, slot_begins_);
  d.rung = rung;
  d.safe_causes = causes_;
  consider_rearm(sensors);
  decided_ = d.command;
  last_time_s_ = time_s;
  started_ = true;
  return d;
}

/// Ticks that were skipped passed under the last command, unmeasured.
void FallbackLadder::catch_up(double time_s) noexcept {
  if (!started_) return;
  const auto missed = std::llround((time_s - last_time_s_) / tick_s) - 1;
  if (missed < 1) return;
  plausibility_.skip(static_cast<int>(std::min<long long>(missed, most_predicted_ticks)));
  Sensors unknown;
  unknown.position_m = unknown.pressure_a_pa = unknown.pressure_b_pa = std::numeric_limits<double>::quiet_NaN();
  for (long long k = 0; k < std::min<long long>(missed, most_predicted_ticks); ++k) {
    watch_.update(unknown);
    assume(last_left_);
  }
}

void FallbackLadder::assume(const Command& command) noexcept {
  last_left_ = command;
  lines_.command(command.coils, timing_);
  SwitchedOf<PneumaticActuator> opening{};
  std::ranges::copy(modes_.point(lines_.effective()), opening.begin());
  watch_.applied(opening, command.motor_force_n);
  lines_.advance(1);
}

void FallbackLadder::applied(const Command& command) noexcept {
  // The exit replaces by zero what it refuses: a command that was no number or no allowed pattern.
  refused_ = !std::isfinite(decided_.motor_force_n) || modes_.find(decided_.coils) < 0;
  controller_->applied(command);
  assume(command);
}

void FallbackLadder::restart(double time_s, double position_m) noexcept {
  reference_.restart(time_s, position_m);
  controller_->restart(time_s, position_m);
}

/// Of the two chambers, by the valves in effect, per tick; at rest, which is what matters to a stuck sensor.
std::array<double, 2> FallbackLadder::expected_pressure_change() const noexcept {
  if (!started_ || !finite(watched_)) return {};
  ActuatorState x = model_.nearest_valid(watched_);
  x[velocity] = 0.0;
  SwitchedOf<PneumaticActuator> opening{};
  std::ranges::copy(modes_.point(lines_.effective()), opening.begin());
  const ActuatorState next = model_.step<double>(x, opening, {0.0}, tick_s);
  return {next[pressure_a] - x[pressure_a], next[pressure_b] - x[pressure_b]};
}

void FallbackLadder::look_for_danger(const Sensors& sensors, const Plausibility::Verdict& verdict,
                                     Decision& d) noexcept {
  FaultSet found;
  const double y = verdict.sensors.position_m;
  if (std::isfinite(y) && (y < settings_.position_low_m || y > settings_.position_high_m))
    found.add(Fault::position_limit);
  for (const double p : {verdict.sensors.pressure_a_pa, verdict.sensors.pressure_b_pa})
    if (std::isfinite(p) && p > settings_.pressure_limit_pa) found.add(Fault::pressure_limit);
  if (started_ && sensors.time_s - last_time_s_ > (settings_.longest_gap_ticks + 0.5) * tick_s)
    found.add(Fault::tick_gap);
  if (started_ && sensors.node_was_safe) found.add(Fault::node_safe);
  if (refused_) found.add(Fault::command_refused);
  if (const int why = stop_.load(std::memory_order_relaxed)) found.add(static_cast<Fault>(why - 1));
  d.faults = verdict.seen;
  d.faults |= verdict.failed;
  d.faults |= found;
  FaultSet causes = found;
  if (verdict.failed.any(Sensor::position)) causes |= verdict.failed;
  if (!causes.empty()) latch(causes, sensors.time_s);
  sound_ticks_ = verdict.seen.empty() && found.empty() ? sound_ticks_ + 1 : 0;
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
void FallbackLadder::consider_rearm(const Sensors& sensors) noexcept {
  if (!rearm_.exchange(false, std::memory_order_relaxed) || !safe_) return;
  const bool at_rest = std::abs(watched_[velocity]) <= settings_.rearm_speed_m_s;
  if (sound_ticks_ < settings_.rearm_sound_ticks || !at_rest || stop_.load(std::memory_order_relaxed) != 0) {
    ++counts_.refused_rearms;
    return;
  }
  // A failed sensor reads sound again; it starts anew, as do the filter and the task.
  plausibility_.reset();
  watch_ = new_watch_;
  safe_ = false;
  causes_ = {};
  dmpc_slots_ = motor_slots_ = 0;
  ++counts_.rearms;
  restart(sensors.time_s, sensors.position_m);
}

Rung FallbackLadder::choose(const Decision& d, const Plausibility::Verdict& verdict, double time_s) noexcept {
  if (safe_) return Rung::safe;
  if (verdict.failed.any(Sensor::pressure_a) || verdict.failed.any(Sensor::pressure_b))
    return below_plans(time_s, verdict.failed);
  const bool soon_enough = d.plan_age < (settings_.shifted_slots + 1) * ticks_per_period;
  if (d.planned && (d.rung == Rung::fresh || soon_enough)) return d.rung;
  return below_plans(time_s, {});
}

/// Without pressures (`failed`) nothing can be said about the valves.
Rung FallbackLadder::below_plans(double time_s, FaultSet failed) noexcept {
  if (failed.empty() && dmpc_slots_ < settings_.dmpc_slots) return Rung::dmpc;
  if (motor_ && motor_slots_ < settings_.motor_slots) return Rung::motor;
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
    case Rung::dmpc:
      if (slot_begins_ || last_ != Rung::dmpc) dmpc_coils_ = candidates_.search(d.estimate, lines_, reference_, time_s);
      d.command.coils = dmpc_coils_;
      return;
    case Rung::motor:
      d.command = {0, motor_->force(d.reference, watched_)};
      return;
    case Rung::safe:
      break;
  }
  d.command = {};
  const double v = watched_[velocity];
  if (time_s - safe_since_s_ < settings_.lowering_s && std::isfinite(v) && !refused_ &&
      !causes_.has(Fault::command_refused))
    d.command.motor_force_n = model_.saturated_motor_force(-settings_.lowering_damping * v);
}

void FallbackLadder::count(Rung rung, bool slot_begins) noexcept {
  last_ = rung;
  if (!slot_begins) return;
  ++counts_.slots[static_cast<std::size_t>(rung)];
  dmpc_slots_ = rung == Rung::fresh ? 0 : dmpc_slots_ + (rung == Rung::dmpc);
  motor_slots_ = rung == Rung::fresh ? 0 : motor_slots_ + (rung == Rung::motor);
}

}  // namespace solenoid
