#include "core/metrics/metrics.hpp"

#include "core/signal/filters.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace solenoid {
namespace {

constexpr double normal_density_g_per_l = 1.2929;  // dry air at 0 C, 101 325 Pa (DIN 1343)

struct ErrorSums {
  double squares = 0, largest = 0;
  void add(double error_mm) {
    squares += error_mm * error_mm;
    largest = std::max(largest, std::abs(error_mm));
  }
  double rms(std::size_t n) const { return std::sqrt(squares / static_cast<double>(n)); }
};

void steady_part(std::span<const TickRecord> ticks, double from_s, double tick_s, double air_kg, Metrics& m) {
  double sum = 0, sum_abs = 0, low = 1e300, high = -1e300;
  int n = 0, switches = 0;
  SwitchPattern coils = 0;
  for (const TickRecord& t : ticks) {
    const int changed = std::popcount(t.applied.coils ^ coils);
    coils = t.applied.coils;
    if (t.sensors.time_s < from_s) continue;
    switches += changed;
    const double y = 1e3 * t.sensors.truth[position], error = 1e3 * t.decision.reference.position - y;
    sum += error;
    sum_abs += std::abs(error);
    m.sse_max_abs_mm = std::max(m.sse_max_abs_mm, std::abs(error));
    low = std::min(low, y);
    high = std::max(high, y);
    ++n;
  }
  if (n == 0) return;
  m.sse_abs_mean_mm = std::abs(sum) / n;
  m.sse_mean_abs_mm = sum_abs / n;
  m.ssa_mm = high - low;
  m.steady_switches_per_s = switches / (n * tick_s);
  m.steady_air_g_per_s = 1e3 * air_kg / (n * tick_s);
}

/// Largest excursion beyond the last desired position, in the direction of the move, relative to the steady value the
/// slide settles at (Table 5-2: "relative to steady-state").
double overshoot_percent(std::span<const TickRecord> ticks, const Trajectory& trajectory) {
  if (!trajectory.steady_from_s()) return 0.0;
  const double goal = trajectory.at(trajectory.duration_s()).position, travel = goal - trajectory.start_m();
  if (travel == 0.0) return 0.0;
  double settled = 0, peak = -1e300;
  int n = 0;
  for (const TickRecord& t : ticks) {
    const double way = (t.sensors.truth[position] - trajectory.start_m()) / travel;
    peak = std::max(peak, way);
    if (t.sensors.time_s >= *trajectory.steady_from_s()) settled += way, ++n;
  }
  if (n == 0) return 0.0;
  settled /= n;
  return std::max(0.0, 100.0 * (peak - settled) / settled);
}

}  // namespace

Percentiles percentiles(std::vector<double>& sample) {
  if (sample.empty()) return {};
  std::sort(sample.begin(), sample.end());
  const auto rank = [&](double p) {
    const double n = static_cast<double>(sample.size());
    return sample[static_cast<std::size_t>(std::clamp(std::ceil(p * n) - 1.0, 0.0, n - 1.0))];
  };
  return {rank(0.5), rank(0.9), rank(0.99), rank(0.999), sample.back()};
}

Metrics evaluate_run(std::span<const TickRecord> ticks, const Trajectory& trajectory, double tick_s, const AirUse& air,
                     double deadline_us) {
  Metrics m;
  if (ticks.empty()) return m;
  ErrorSums truth, measured;
  double motor_squares = 0;
  int solves = 0, proven = 0;
  SwitchPattern coils = 0;
  std::vector<double> solve_us;
  Butterworth2 filter(50.0, 1.0 / tick_s);
  filter.reset(ticks.front().sensors.position_m);
  for (const TickRecord& t : ticks) {
    const double desired = t.decision.reference.position;
    const double error = 1e3 * (desired - t.sensors.truth[position]);
    truth.add(error);
    const double filtered = t.sensors.ideal ? t.sensors.truth[position] : filter.step(t.sensors.position_m);
    measured.add(1e3 * (desired - filtered));
    m.finite = m.finite && std::isfinite(error) && std::isfinite(t.sensors.truth[pressure_a]) &&
               std::isfinite(t.sensors.truth[pressure_b]);
    m.itae += t.sensors.time_s * std::abs(error) * tick_s;
    m.coil_switches += std::popcount(t.applied.coils ^ coils);
    coils = t.applied.coils;
    motor_squares += t.applied.motor_force_n * t.applied.motor_force_n;
    if (!t.decision.solved) continue;
    ++solves;
    proven += t.decision.report.status == Status::optimal;
    m.deadline_misses += t.decision.report.time_us > deadline_us;
    solve_us.push_back(t.decision.report.time_us);
  }
  const auto n = static_cast<double>(ticks.size());
  m.rmse_mm = truth.rms(ticks.size());
  m.mae_mm = truth.largest;
  m.rmse_measured_mm = measured.rms(ticks.size());
  m.mae_measured_mm = measured.largest;
  m.motor_rms_n = std::sqrt(motor_squares / n);
  m.switches_per_s = m.coil_switches / (n * tick_s);
  m.air_g = 1e3 * air.total_kg;
  m.air_nl = m.air_g / normal_density_g_per_l;
  if (trajectory.steady_from_s()) steady_part(ticks, *trajectory.steady_from_s(), tick_s, air.steady_kg, m);
  m.overshoot_percent = overshoot_percent(ticks, trajectory);
  m.proven_optimal_fraction = solves ? static_cast<double>(proven) / solves : 0.0;
  m.solve_us = percentiles(solve_us);
  return m;
}

}  // namespace solenoid
