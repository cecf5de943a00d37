#include "experiments/thesis/step_figures.hpp"

#include "controllers/timing.hpp"
#include "core/signal/filters.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace solenoid {
namespace {

std::vector<double> positions_m(std::span<const TickRecord> ticks, PositionSignal signal) {
  std::vector<double> y;
  y.reserve(ticks.size());
  Butterworth2 filter(50.0, 1.0 / tick_s);
  if (!ticks.empty()) filter.reset(ticks.front().sensors.position_m);
  for (const TickRecord& t : ticks)
    y.push_back(signal == PositionSignal::truth ? t.sensors.truth[position] : filter.step(t.sensors.position_m));
  return y;
}

}  // namespace

StepFigures step_figures(std::span<const TickRecord> ticks, const Trajectory& trajectory, PositionSignal signal) {
  const std::vector<double> y = positions_m(ticks, signal);
  const double steady_from_s = trajectory.steady_from_s().value_or(trajectory.duration_s());
  const double goal = trajectory.at(trajectory.duration_s()).position;
  const double direction = goal < trajectory.start_m() ? -1.0 : 1.0;
  StepFigures figures;
  double peak = 0, travelled = 0, error = 0;
  int n = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double way = direction * (y[i] - trajectory.start_m());
    peak = std::max(peak, way);
    if (ticks[i].sensors.time_s < steady_from_s) continue;
    const double e_mm = 1e3 * (goal - y[i]);
    figures.max_abs_error_mm = std::max(figures.max_abs_error_mm, std::abs(e_mm));
    figures.mean_abs_error_mm += std::abs(e_mm);
    error += e_mm;
    travelled += way;
    ++n;
  }
  if (n == 0) return figures;
  figures.mean_abs_error_mm /= n;
  figures.abs_mean_error_mm = std::abs(error) / n;
  figures.overshoot_percent = std::max(0.0, 100.0 * (peak - travelled / n) / (travelled / n));
  return figures;
}

}  // namespace solenoid
