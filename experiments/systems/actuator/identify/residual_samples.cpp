#include "experiments/systems/actuator/identify/residual_samples.hpp"

#include "core/systems/actuator/dynamics.hpp"
#include "experiments/systems/actuator/identify/signals.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace solenoid {
namespace {

constexpr double residual_width_s = 0.008;  // of the Gaussian
constexpr double residual_sample_s = 0.02;  // two and a half of it: noise of neighbours is all but independent
constexpr double residual_rest_m_s = 2e-3;  // slower may be at rest
constexpr double residual_rest_s = 0.03;    // for so long
constexpr double residual_reach_s = 0.04;   // of the Gaussian and the filter
constexpr double residual_margin_s = 0.15;  // at a record's ends
constexpr double residual_stop_m = 1e-3;    // from an end stop

double direction_at(double v) { return (v > 0) - (v < 0); }

/// The samples at which nothing of a rest can be felt.
std::vector<bool> moving(const std::vector<double>& v, double period_s) {
  const auto samples = [period_s](double s) { return static_cast<std::size_t>(s / period_s); };
  const std::size_t n = v.size(), reach = samples(residual_reach_s), margin = std::min(n, samples(residual_margin_s));
  std::vector<bool> good(n, true);
  for (std::size_t t = 0; t < n;) {
    std::size_t end = t;
    while (end < n && std::abs(v[end]) < residual_rest_m_s) ++end;
    if (end - t > samples(residual_rest_s))
      for (std::size_t i = t > reach ? t - reach : 0; i < std::min(n, end + reach); ++i) good[i] = false;
    t = end + 1;
  }
  for (std::size_t i = 0; i < margin; ++i) good[i] = good[n - 1 - i] = false;
  return good;
}

/// A record's signals, all late by the pressure filter.
class LateSignals {
 public:
  LateSignals(const Record& record, double filter_hz)
      : record_(record), delay_s_(filter_hz > 0.0 ? bessel_cutoff_hz(1.0) / filter_hz : 0.0) {}

  std::vector<double> smooth(const std::vector<double>& signal) const {
    return gaussian(signal, record_.period_s, residual_width_s);
  }
  std::vector<double> late(std::vector<double> signal, Between between = Between::straight) const {
    return delay_s_ > 0.0 ? through_bessel(signal, record_.period_s, delay_s_, between) : std::move(signal);
  }
  std::vector<double> position(int derivative) const {
    return late(gaussian(record_.position_m, record_.period_s, residual_width_s, derivative));
  }

 private:
  const Record& record_;
  double delay_s_;
};

}  // namespace

std::vector<ResidualSample> residual_samples(const Record& record, const ActuatorParameters& believed,
                                             double pressure_filter_hz) {
  ActuatorParameters unloaded = believed;
  unloaded.payload_mass_kg = 0.0;
  unloaded.plane = record.plane;
  const PneumaticActuator model(unloaded);
  const double mass = unloaded.equivalent_mass_kg(), radius = unloaded.gear_radius_m(), length = unloaded.arm_length_m;
  const double arm_weight = record.plane == Plane::vertical ? unloaded.gravity * length / radius : 0.0;
  const LateSignals signals(record, pressure_filter_hz);
  const std::size_t n = record.size();

  std::vector<double> cylinder(n), gravity(n), arm(n), motor(n), way(n);
  // Smoothing sees a reversal late: friction jumps there, and the smoothed speed is short of the true one (slide.cpp).
  const double short_of = unloaded.coulomb_friction_n / mass * residual_width_s * std::sqrt(2 / std::numbers::pi);
  const std::vector<double> speed = gaussian(record.position_m, record.period_s, residual_width_s, 1),
                            change = gaussian(record.position_m, record.period_s, residual_width_s, 2);
  for (std::size_t t = 0; t < n; ++t) {
    cylinder[t] = model.cylinder_force(record.pressure_a_pa[t], record.pressure_b_pa[t]);
    gravity[t] = model.gravity_force(record.position_m[t]);
    arm[t] = std::sin(record.position_m[t] / radius);
    motor[t] = model.saturated_motor_force(record.motor_n[t]);
    way[t] = direction_at(speed[t] + short_of * direction_at(change[t]));
  }
  cylinder = signals.smooth(cylinder);
  gravity = signals.late(signals.smooth(gravity));
  arm = signals.late(signals.smooth(arm));
  motor = signals.late(signals.smooth(motor), Between::held);
  way = signals.late(signals.smooth(way));
  const std::vector<double> y = signals.position(0), v = signals.position(1), a = signals.position(2);
  const std::vector<bool> good = moving(v, record.period_s);

  std::vector<ResidualSample> samples;
  const auto every =
      std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(residual_sample_s / record.period_s)));
  for (std::size_t t = 0; t < n; t += every) {
    if (!good[t] || std::abs(v[t]) < residual_rest_m_s) continue;
    if (y[t] < unloaded.position_min_m() + residual_stop_m || y[t] > unloaded.position_max_m() - residual_stop_m)
      continue;
    const double friction = unloaded.coulomb_friction_n * way[t] + unloaded.viscous_friction * v[t];
    samples.push_back({y[t], v[t], mass * a[t] + friction - cylinder[t] - gravity[t] - motor[t],
                       -(length * length / (radius * radius) * a[t] + arm_weight * arm[t])});
  }
  return samples;
}

}  // namespace solenoid
