#include "experiments/rig/preflight.hpp"

#include "core/rt/clock.hpp"

#include <array>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {

Preflight preflight(Plant& plant, const SystemDescription& system, const PlausibilitySettings& settings,
                    double tick_s) {
  constexpr int ticks = 100;
  Preflight found;
  Plausibility plausibility(settings);
  MonotonicClock clock;
  std::vector<double> read_us;
  AxisValues sum{};
  std::array<int, max_axes> sound{};
  for (int k = 0; k < ticks; ++k) {
    clock.sleep_until((k + 1) * tick_s);
    const double begin = clock.now_s();
    Measurement sensors = plant.read(0.0);
    read_us.push_back(1e6 * (clock.now_s() - begin));
    if (sensors.stale_ticks > 0) ++found.missed;
    const auto verdict = plausibility.check(sensors, {}, {});
    found.faults |= verdict.failed;
    for (std::size_t a = 0; a < system.axes.size(); ++a) {
      const double value = verdict.measured.value[system.axes[a].channel];
      if (!std::isfinite(value)) continue;
      sum[a] += value;
      ++sound[a];
    }
  }
  for (std::size_t a = 0; a < system.axes.size(); ++a) found.at[a] = sound[a] > 0 ? sum[a] / sound[a] : 0.0;
  found.read_us = percentiles(read_us);
  return found;
}

std::string Preflight::text(const SystemDescription& system) const {
  std::string where;
  for (std::size_t a = 0; a < system.axes.size(); ++a)
    where += fmt::format("{} at {:.2f} {}, ", system.axes[a].signal.label, system.axes[a].shown_scale * at[a],
                         system.axes[a].shown_unit);
  return fmt::format("preflight: {}sensors {}, I/O p50 {:.0f} us, max {:.0f} us, {} of 100 reads missed", where,
                     faults.empty() ? "plausible" : to_string(faults, system), read_us.p50, read_us.max, missed);
}

}  // namespace solenoid
