#include "core/metrics/tracking.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace solenoid {

TrackingFigures tracking_figures(std::span<const TickRecord> ticks, const SystemDescription& system, double tick_s,
                                 SwitchPattern start) {
  TrackingFigures f;
  SwitchPattern before = start;
  for (const TickRecord& t : ticks) {
    for (std::size_t a = 0; a < system.axes.size(); ++a) {
      const double error = t.decision.reference.axis[a].value - t.sensors.truth[system.axes[a].state];
      f.axis[a].rms += error * error;
      f.axis[a].largest = std::max(f.axis[a].largest, std::abs(error));
    }
    for (std::size_t i = 0; i < system.states.size(); ++i) f.finite = f.finite && std::isfinite(t.sensors.truth[i]);
    f.switches += std::popcount(t.applied.switches ^ before);
    before = t.applied.switches;
  }
  const auto n = static_cast<double>(ticks.size());
  for (AxisErrors& axis : f.axis) axis.rms = ticks.empty() ? 0.0 : std::sqrt(axis.rms / n);
  f.duration_s = n * tick_s;
  return f;
}

}  // namespace solenoid
