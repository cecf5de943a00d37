#include "experiments/rig/preflight.hpp"

#include "core/rt/clock.hpp"
#include "core/systems/actuator/signals.hpp"

#include <cmath>

#include <fmt/format.h>

namespace solenoid {

Preflight preflight(Plant& plant, const PlausibilitySettings& settings, double tick_s) {
  constexpr int ticks = 100;
  Preflight found;
  Plausibility plausibility(settings);
  MonotonicClock clock;
  std::vector<double> read_us;
  double sum = 0.0;
  int sound = 0;
  for (int k = 0; k < ticks; ++k) {
    clock.sleep_until((k + 1) * tick_s);
    plant.write({});
    const double begin = clock.now_s();
    Measurement sensors = plant.read(0.0);
    read_us.push_back(1e6 * (clock.now_s() - begin));
    if (sensors.stale_ticks > 0) ++found.missed;
    const auto verdict = plausibility.check(sensors, {}, {});
    found.faults |= verdict.failed;
    if (!std::isfinite(verdict.measured.value[position_channel])) continue;
    sum += verdict.measured.value[position_channel];
    ++sound;
  }
  found.position_m = sound > 0 ? sum / sound : 0.0;
  found.read_us = percentiles(read_us);
  return found;
}

std::string Preflight::text() const {
  return fmt::format(
      "preflight: slide at {:.2f} mm, sensors {}, I/O p50 {:.0f} us, max {:.0f} us, {} of 100 reads missed",
      1e3 * position_m, faults.empty() ? "plausible" : to_string(faults, actuator_description()), read_us.p50,
      read_us.max, missed);
}

}  // namespace solenoid
