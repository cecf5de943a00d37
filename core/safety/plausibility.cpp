#include "core/safety/plausibility.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace solenoid {
namespace {

/// After a value that was left out the next may be further away, but not by a whole first step a tick: a jump must not
/// become plausible by waiting.
constexpr double slew_growth = 0.2;

}  // namespace

Plausibility::Plausibility(const PlausibilitySettings& settings, double atmosphere_pa, double supply_pa)
    : settings_(settings),
      lowest_pa_(atmosphere_pa - settings.supply_margin_pa),
      highest_pa_(supply_pa + settings.supply_margin_pa) {}

void Plausibility::reset() noexcept { channels_ = {}; }

void Plausibility::skip(int ticks) noexcept {
  for (Channel& c : channels_) c.since_good += ticks;
}

/// What a single value shows.
bool Plausibility::at_once(Sensor sensor, double value, const Channel& c, FaultSet& seen) const noexcept {
  if (!std::isfinite(value)) {
    seen.add(sensor, SensorFault::not_finite);
    return false;
  }
  const SensorBounds& b = bounds(sensor);
  bool good = true;
  const auto refuse = [&](SensorFault kind) {
    seen.add(sensor, kind);
    good = false;
  };
  if (value <= b.rail_low + b.rail_margin || value >= b.rail_high - b.rail_margin)
    refuse(SensorFault::rail);
  else if (value < b.low || value > b.high)
    refuse(SensorFault::range);
  if (c.started && std::abs(value - c.last_good) > b.slew_per_tick * (1.0 + slew_growth * c.since_good))
    refuse(SensorFault::slew);
  return good;
}

/// What only several ticks show; these find the sensor failed at once.
bool Plausibility::over_time(Sensor sensor, double value, Channel& c, FaultSet& seen) noexcept {
  const bool position = sensor == Sensor::position;
  const bool same = c.started && value == c.last_raw;
  c.unchanged = same ? c.unchanged + 1 : 0;
  if (!same) c.expected_pa = 0.0;
  c.last_raw = value;
  FaultSet found;
  if (position && settings_.stuck_ticks > 0 && c.unchanged >= settings_.stuck_ticks)
    found.add(sensor, SensorFault::stuck);
  // What the valves did within the delay of the pressure filters cannot show yet.
  const bool overdue = !position && settings_.stuck_pa > 0 && std::abs(c.expected_pa) > settings_.stuck_pa;
  c.overdue = overdue ? c.overdue + 1 : 0;
  if (c.overdue > settings_.stuck_lag_ticks) found.add(sensor, SensorFault::stuck);
  const bool beyond = !position && (value < lowest_pa_ || value > highest_pa_);
  c.beyond_supply = beyond ? c.beyond_supply + 1 : 0;
  if (c.beyond_supply > settings_.supply_ticks) found.add(sensor, SensorFault::supply);
  if (c.squares > settings_.innovation_limit) found.add(sensor, SensorFault::innovation);
  seen |= found;
  c.failed |= found;
  return found.empty();
}

bool Plausibility::usable(Sensor sensor, double value, Channel& c, FaultSet& seen) noexcept {
  FaultSet now;
  const bool good = at_once(sensor, value, c, now);
  seen |= now;
  if (!good) {
    c.suspicion += 1.0;
    ++c.since_good;
    if (c.suspicion > settings_.patience_ticks) c.failed |= now;
    return false;
  }
  c.slope = c.started ? std::abs(value - c.last_good) : 0.0;
  const bool sound = over_time(sensor, value, c, seen);
  c.suspicion = std::max(0.0, c.suspicion - 1.0 / settings_.recovery_ticks);
  c.since_good = 0;
  c.last_good = value;
  c.started = true;
  return sound && c.failed.empty();
}

/// Samples are not taken to the microsecond: half a tick of a steep slope is no fault. One outlier is none either.
void Plausibility::average(Sensor sensor, double innovation, Channel& c) const noexcept {
  const double unsure = settings_.jitter_ticks * c.slope / bounds(sensor).sigma;
  const double weighed = innovation / (1.0 + unsure * unsure);
  c.squares += (std::min(weighed, 5 * settings_.innovation_limit) - c.squares) / settings_.innovation_ticks;
}

Plausibility::Verdict Plausibility::check(const Sensors& sensors, const std::array<double, 2>& expected_pa_per_tick,
                                          const std::array<double, sensor_count>& innovations) noexcept {
  Verdict verdict;
  verdict.sensors = sensors;
  double* const values[] = {&verdict.sensors.position_m, &verdict.sensors.pressure_a_pa,
                            &verdict.sensors.pressure_b_pa};
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    Channel& c = channels_[i];
    const auto sensor = static_cast<Sensor>(i);
    if (i > 0) c.expected_pa += expected_pa_per_tick[i - 1];
    average(sensor, innovations[i], c);
    bool good = sensors.stale_ticks == 0;
    if (good) {
      good = usable(sensor, *values[i], c, verdict.seen);
    } else {
      verdict.seen.add(sensor, SensorFault::stale);
      ++c.since_good;
      if (sensors.stale_ticks > settings_.stale_ticks) c.failed.add(sensor, SensorFault::stale);
    }
    if (!good) *values[i] = std::numeric_limits<double>::quiet_NaN();
    verdict.failed |= c.failed;
  }
  return verdict;
}

}  // namespace solenoid
