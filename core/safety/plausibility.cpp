#include "core/safety/plausibility.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace solenoid {
namespace {

/// After a value that was left out the next may be further away, but not by a whole first step a tick: a jump must not
/// become plausible by waiting.
constexpr double slew_growth = 0.2;

/// How many ticks' motion a value may be away from the last good one: as many as lie between the two measurements, of
/// which those that were waited for without a good value count as slew_growth. `younger`: so many ticks younger than
/// the last this value is, negative where it is older, which takes from the ticks that were waited for first. Two
/// samples are apart by more than what their ages are unsure of, `least`.
double slew_ticks(int since_good, double younger, double least) {
  const double waited = since_good + std::min(0.0, younger);
  const double apart = waited >= 0 ? 1.0 + slew_growth * waited : 1.0 + waited;
  return std::max(least, apart) + std::max(0.0, younger);
}

}  // namespace

int stuck_ticks_of(const ChannelNoise& noise) noexcept {
  if (noise.sigma <= 0) return 0;
  // -ln p by what is missing to 1, which p itself is rounded to from some 17 sigma on; 0 where even that underflows.
  const double surprise = -std::log1p(-std::erfc(noise.quantum / (std::sqrt(8.0) * noise.sigma)));
  const double independent = std::log(stuck_false_alarm_ticks) / std::max(surprise, 0.0);
  const double ticks = std::ceil(std::max(2.0, independent) * std::max(1.0, noise.ticks));
  return ticks <= most_stuck_ticks ? static_cast<int>(ticks) : 0;
}

Plausibility::Plausibility(const PlausibilitySettings& settings) : settings_(settings) {
  settings_.channels.resize(std::min(settings_.channels.size(), max_channels));
}

void Plausibility::reset() noexcept { channels_ = {}; }

void Plausibility::skip(int ticks) noexcept {
  for (Channel& c : channels_) c.since_good += ticks;
}

/// What a single value shows.
bool Plausibility::at_once(std::size_t channel, double value, FaultSet& seen) const noexcept {
  if (!std::isfinite(value)) {
    seen.add(channel, SensorFault::not_finite);
    return false;
  }
  const SensorBounds& b = settings_.channels[channel];
  const Channel& c = channels_[channel];
  bool good = true;
  const auto refuse = [&](SensorFault kind) {
    seen.add(channel, kind);
    good = false;
  };
  if (value <= b.rail_low + b.rail_margin || value >= b.rail_high - b.rail_margin)
    refuse(SensorFault::rail);
  else if (value < b.low || value > b.high)
    refuse(SensorFault::range);
  const double moving = slew_ticks(c.since_good, (c.age_s - age_s_) / settings_.tick_s, settings_.jitter_ticks);
  if (c.started && std::abs(value - c.last_good) > b.slew_per_tick * moving) refuse(SensorFault::slew);
  return good;
}

/// What only several ticks show; these find the channel failed at once.
bool Plausibility::over_time(std::size_t channel, double value, FaultSet& seen) noexcept {
  const SensorBounds& b = settings_.channels[channel];
  Channel& c = channels_[channel];
  const bool same = c.started && value == c.last_raw;
  c.unchanged = same ? c.unchanged + 1 : 0;
  if (!same) c.expected = 0.0;
  c.last_raw = value;
  FaultSet found;
  if (b.stuck_ticks > 0 && c.unchanged >= b.stuck_ticks) found.add(channel, SensorFault::stuck);
  // What the inputs did within the delay of the channel's filter cannot show yet.
  const bool overdue = b.stuck_change > 0 && std::abs(c.expected) > b.stuck_change;
  c.overdue = overdue ? c.overdue + 1 : 0;
  if (c.overdue > settings_.stuck_lag_ticks) found.add(channel, SensorFault::stuck);
  c.beyond_supply = value < b.supply_low || value > b.supply_high ? c.beyond_supply + 1 : 0;
  if (c.beyond_supply > settings_.supply_ticks) found.add(channel, SensorFault::supply);
  if (c.squares > settings_.innovation_limit) found.add(channel, SensorFault::innovation);
  seen |= found;
  c.failed |= found;
  return found.empty();
}

bool Plausibility::usable(std::size_t channel, double value, FaultSet& seen) noexcept {
  Channel& c = channels_[channel];
  FaultSet now;
  const bool good = at_once(channel, value, now);
  seen |= now;
  if (!good) {
    c.suspicion += 1.0;
    ++c.since_good;
    if (c.suspicion > settings_.patience_ticks) c.failed |= now;
    return false;
  }
  c.slope = c.started ? std::abs(value - c.last_good) : 0.0;
  const bool sound = over_time(channel, value, seen);
  c.suspicion = std::max(0.0, c.suspicion - 1.0 / settings_.recovery_ticks);
  c.since_good = 0;
  c.last_good = value;
  c.age_s = age_s_;
  c.started = true;
  return sound && c.failed.empty();
}

/// Samples are not taken to the microsecond: half a tick of a steep slope is no fault. One outlier is none either.
void Plausibility::average(std::size_t channel, double innovation) noexcept {
  Channel& c = channels_[channel];
  const double unsure = settings_.jitter_ticks * c.slope / settings_.channels[channel].sigma;
  const double weighed = innovation / (1.0 + unsure * unsure);
  c.squares += (std::min(weighed, 5 * settings_.innovation_limit) - c.squares) / settings_.innovation_ticks;
}

Plausibility::Verdict Plausibility::check(const Measurement& measured, const ChannelValues& expected_per_tick,
                                          const ChannelValues& innovations) noexcept {
  Verdict verdict;
  verdict.measured = measured;
  age_s_ = measured.age_s;
  for (std::size_t i = 0; i < settings_.channels.size(); ++i) {
    Channel& c = channels_[i];
    double& value = verdict.measured.value[i];
    c.expected += expected_per_tick[i];
    average(i, innovations[i]);
    bool good = measured.stale_ticks == 0;
    if (good) {
      good = usable(i, value, verdict.seen);
    } else {
      verdict.seen.add(i, SensorFault::stale);
      ++c.since_good;
      if (measured.stale_ticks > settings_.stale_ticks) c.failed.add(i, SensorFault::stale);
    }
    if (!good) value = std::numeric_limits<double>::quiet_NaN();
    verdict.failed |= c.failed;
  }
  return verdict;
}

}  // namespace solenoid
