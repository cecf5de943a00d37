#include "experiments/systems/actuator/thesis/position_figures.hpp"

#include "core/signal/filters.hpp"
#include "core/systems/actuator/signals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace solenoid {
namespace {

std::vector<double> positions_m(std::span<const TickRecord> ticks, PositionSignal signal) {
  std::vector<double> y;
  y.reserve(ticks.size());
  Butterworth2 filter(50.0, 1.0 / actuator_timing.tick_s);
  if (!ticks.empty()) filter.reset(ticks.front().sensors.value[position_channel]);
  for (const TickRecord& t : ticks)
    y.push_back(signal == PositionSignal::truth ? t.sensors.truth[position]
                                                : filter.step(t.sensors.value[position_channel]));
  return y;
}

}  // namespace

PositionFigures position_figures(std::span<const TickRecord> ticks, const Trajectory& trajectory,
                                 PositionSignal signal) {
  const std::vector<double> y = positions_m(ticks, signal);
  const double steady_from_s = trajectory.steady_from_s().value_or(std::numeric_limits<double>::infinity());
  const double start_m = trajectory.start();
  const double direction = trajectory.at(trajectory.duration_s()).value < start_m ? -1.0 : 1.0;
  PositionFigures f;
  double squares = 0, peak_m = 0, low_m = 1e9, high_m = -1e9, errors = 0, travelled_m = 0;
  int steady = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double e = 1e3 * (trajectory.at(ticks[i].sensors.time_s).value - y[i]);
    const double way_m = direction * (y[i] - start_m);
    squares += e * e;
    f.mae_mm = std::max(f.mae_mm, std::abs(e));
    peak_m = std::max(peak_m, way_m);
    if (ticks[i].sensors.time_s < steady_from_s) continue;
    f.sse_max_abs_mm = std::max(f.sse_max_abs_mm, std::abs(e));
    f.sse_mean_abs_mm += std::abs(e);
    errors += e;
    travelled_m += way_m;
    low_m = std::min(low_m, y[i]);
    high_m = std::max(high_m, y[i]);
    ++steady;
  }
  f.rmse_mm = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, y.size())));
  if (steady == 0) return f;
  f.sse_mean_abs_mm /= steady;
  f.sse_abs_mean_mm = std::abs(errors) / steady;
  f.ssa_mm = 1e3 * (high_m - low_m);
  f.overshoot_percent = std::max(0.0, 100.0 * (peak_m * steady / travelled_m - 1.0));
  return f;
}

}  // namespace solenoid
