#include "core/systems/actuator/metrics.hpp"

#include "core/signal/filters.hpp"
#include "core/systems/actuator/signals.hpp"

#include <algorithm>
#include <array>
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
  double sum = 0, sum_abs = 0, largest = 0, low = 1e300, high = -1e300;
  int n = 0, switches = 0;
  SwitchPattern coils = 0;
  for (const TickRecord& t : ticks) {
    const int changed = std::popcount(t.applied.switches ^ coils);
    coils = t.applied.switches;
    if (t.sensors.time_s < from_s) continue;
    switches += changed;
    const double y = 1e3 * t.sensors.truth[position], error = 1e3 * t.decision.reference.axis[0].value - y;
    sum += error;
    sum_abs += std::abs(error);
    largest = std::max(largest, std::abs(error));
    low = std::min(low, y);
    high = std::max(high, y);
    ++n;
  }
  if (n == 0) return;
  m["sse_max_abs_mm"] = largest;
  m["sse_abs_mean_mm"] = std::abs(sum) / n;
  m["sse_mean_abs_mm"] = sum_abs / n;
  m["ssa_mm"] = high - low;
  m["steady_switches_per_s"] = switches / (n * tick_s);
  m["steady_air_g_per_s"] = 1e3 * air_kg / (n * tick_s);
}

/// Largest excursion beyond the last desired position, in the direction of the move, relative to the steady value the
/// slide settles at (Table 5-2: "relative to steady-state").
double overshoot_percent(std::span<const TickRecord> ticks, const Motion& motion) {
  const Trajectory& trajectory = motion.axes().front();
  if (!trajectory.steady_from_s()) return 0.0;
  const double goal = trajectory.at(trajectory.duration_s()).value, travel = goal - trajectory.start();
  if (travel == 0.0) return 0.0;
  double settled = 0, peak = -1e300;
  int n = 0;
  for (const TickRecord& t : ticks) {
    const double way = (t.sensors.truth[position] - trajectory.start()) / travel;
    peak = std::max(peak, way);
    if (t.sensors.time_s >= *trajectory.steady_from_s()) settled += way, ++n;
  }
  if (n == 0) return 0.0;
  settled /= n;
  return std::max(0.0, 100.0 * (peak - settled) / settled);
}

}  // namespace

Metrics evaluate_actuator_run(std::span<const TickRecord> ticks, const Motion& motion, double tick_s,
                              const Consumed& air_kg, double deadline_us) {
  Metrics m;
  for (const MetricColumn& metric : actuator_description().metrics) m[metric.key] = 0.0;
  if (ticks.empty()) return m;
  ErrorSums truth, measured;
  double motor_squares = 0, itae = 0;
  int switches = 0;
  std::array<int, max_switches> changes{};
  SwitchPattern coils = 0;
  Butterworth2 filter(50.0, 1.0 / tick_s);
  filter.reset(ticks.front().sensors.value[position_channel]);
  for (const TickRecord& t : ticks) {
    const double desired = t.decision.reference.axis[0].value;
    const double error = 1e3 * (desired - t.sensors.truth[position]);
    truth.add(error);
    const double filtered =
        t.sensors.ideal ? t.sensors.truth[position] : filter.step(t.sensors.value[position_channel]);
    measured.add(1e3 * (desired - filtered));
    m.finite = m.finite && std::isfinite(error) && std::isfinite(t.sensors.truth[pressure_a]) &&
               std::isfinite(t.sensors.truth[pressure_b]);
    itae += t.sensors.time_s * std::abs(error) * tick_s;
    switches += std::popcount(t.applied.switches ^ coils);
    for (SwitchPattern left = t.applied.switches ^ coils; left != 0; left &= left - 1)
      ++changes[static_cast<std::size_t>(std::countr_zero(left))];
    coils = t.applied.switches;
    motor_squares += motor_force_n(t.applied) * motor_force_n(t.applied);
  }
  const auto n = static_cast<double>(ticks.size());
  m["rmse_mm"] = truth.rms(ticks.size());
  m["mae_mm"] = truth.largest;
  m["rmse_measured_mm"] = measured.rms(ticks.size());
  m["mae_measured_mm"] = measured.largest;
  m["itae"] = itae;
  m["motor_rms_n"] = std::sqrt(motor_squares / n);
  m["coil_switches"] = switches;
  m["switches_per_s"] = switches / (n * tick_s);
  m["busiest_coil_per_s"] = std::ranges::max(changes) / (n * tick_s);
  m["air_g"] = 1e3 * air_kg.total;
  m["air_nl"] = m["air_g"] / normal_density_g_per_l;
  if (motion.steady_from_s()) steady_part(ticks, *motion.steady_from_s(), tick_s, air_kg.steady, m);
  m["overshoot_percent"] = overshoot_percent(ticks, motion);
  add_solves(ticks, deadline_us, m);
  return m;
}

}  // namespace solenoid
