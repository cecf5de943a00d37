#include "experiments/systems/actuator/identify/slide.hpp"

#include "core/systems/actuator/dynamics.hpp"
#include "experiments/systems/actuator/identify/signals.hpp"
#include "experiments/systems/actuator/identify/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>
#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double width_s = 0.025;                // of the Gaussian
constexpr double fine_width_s = 0.008;           // of the one that sees reversals
constexpr double sample_s = 0.01;                // between residuals
constexpr double slide_residual_memory_s = 0.3;  // of residuals
constexpr double rest_m_s = 2e-3;                // slower is at rest, or may be
constexpr double reach_s = 0.14;                 // of the Gaussian and the filter
constexpr double shortest_rest_s = 0.03;

/// A record's columns, sampled, and which of its samples count.
struct Rows {
  std::vector<double> force, acceleration, direction, speed, arm, time_s;
  std::size_t size() const { return force.size(); }
};

double sign_of(double v) { return (v > 0) - (v < 0); }

/// Samples no rest can be felt at.
std::vector<bool> in_motion(const std::vector<double>& v, double period_s, bool reversals) {
  std::vector<bool> good(v.size(), true);
  const auto reach = static_cast<std::size_t>(reach_s / period_s);
  const auto shortest = reversals ? static_cast<std::size_t>(shortest_rest_s / period_s) : std::size_t{0};
  for (std::size_t t = 0; t < v.size();) {
    std::size_t end = t;
    while (end < v.size() && std::abs(v[end]) < rest_m_s) ++end;
    if (end - t > shortest)
      for (std::size_t i = t > reach ? t - reach : 0; i < std::min(v.size(), end + reach); ++i) good[i] = false;
    t = end + 1;
  }
  for (std::size_t i = 0; i < std::min(v.size(), 2 * reach); ++i) good[i] = good[v.size() - 1 - i / 2] = false;
  return good;
}

/// Direction of motion. Smoothing sees a reversal late: friction jumps there, so the speed has a kink, by which the
/// smoothed speed is short of the true one by F_cf/m_eq width sqrt(2/pi), towards the acceleration.
std::vector<double> direction_of(const Record& r, double coulomb_per_mass) {
  const std::vector<double> v = gaussian(r.position_m, r.period_s, fine_width_s, 1);
  const std::vector<double> a = gaussian(r.position_m, r.period_s, width_s, 2);
  const double short_of = coulomb_per_mass * fine_width_s * std::sqrt(2 / std::numbers::pi);
  std::vector<double> direction(r.size());
  for (std::size_t t = 0; t < r.size(); ++t) direction[t] = sign_of(v[t] + short_of * sign_of(a[t]));
  return direction;
}

Rows rows_of(const Record& r, const ActuatorParameters& given, double delay_s, double coulomb_per_mass,
             bool reversals) {
  const PneumaticActuator model(given);
  const std::size_t n = r.size();
  std::vector<double> cylinder(n), arm(n);
  const std::vector<double> direction = direction_of(r, coulomb_per_mass);
  for (std::size_t t = 0; t < n; ++t) {
    cylinder[t] = model.cylinder_force(r.pressure_a_pa[t], r.pressure_b_pa[t]);
    arm[t] = std::sin(r.position_m[t] / given.gear_radius_m()) / given.gear_radius_m();
  }
  const std::vector<double> v = gaussian(r.position_m, r.period_s, width_s, 1);
  const auto smooth = [&](const std::vector<double>& x) { return gaussian(x, r.period_s, width_s); };
  const auto late = [&](const std::vector<double>& x, Between between) {
    return through_bessel(x, r.period_s, delay_s, between);
  };
  const std::vector<double> force = smooth(cylinder), motor = late(smooth(r.motor_n), Between::held);
  const std::vector<double> acceleration = late(gaussian(r.position_m, r.period_s, width_s, 2), Between::straight);
  const std::vector<double> speed = late(v, Between::straight), turned = late(smooth(arm), Between::straight);
  const std::vector<double> way = late(smooth(direction), Between::straight);
  const std::vector<bool> good = in_motion(v, r.period_s, reversals);
  Rows rows;
  const auto every = static_cast<std::size_t>(std::lround(sample_s / r.period_s));
  for (std::size_t t = 0; t < n; t += every) {
    if (!good[t]) continue;
    rows.force.push_back(force[t] + motor[t]);
    rows.acceleration.push_back(acceleration[t]);
    rows.direction.push_back(way[t]);
    rows.speed.push_back(speed[t]);
    rows.arm.push_back(turned[t]);
    rows.time_s.push_back(static_cast<double>(t) * r.period_s);
  }
  return rows;
}

Findings estimate_once(const std::vector<const Record*>& records, const ActuatorParameters& given,
                       double filter_delay_s, const SlideModel& model, const std::string& suffix,
                       double coulomb_per_mass) {
  std::vector<Rows> all;
  std::vector<std::size_t> series;
  bool vertical = false;
  for (const Record* r : records) {
    all.push_back(rows_of(*r, given, filter_delay_s, coulomb_per_mass, model.reversals));
    series.push_back(all.back().size());
    vertical = vertical || r->plane == Plane::vertical;
  }
  struct Column {
    const char *name, *unit;
    double (*value)(const Rows&, std::size_t);
  };
  std::vector<Column> columns;
  if (model.mass)
    columns.push_back({"equivalent_mass_kg", "kg", [](const Rows& r, std::size_t i) { return r.acceleration[i]; }});
  columns.push_back({"coulomb_friction_n", "N", [](const Rows& r, std::size_t i) { return r.direction[i]; }});
  if (model.viscous)
    columns.push_back({"viscous_friction", "N s/m", [](const Rows& r, std::size_t i) { return r.speed[i]; }});
  if (vertical) {
    columns.push_back({"weight_n", "N", [](const Rows&, std::size_t) { return -1.0; }});
    columns.push_back({"arm_torque_nm", "N m", [](const Rows& r, std::size_t i) { return r.arm[i]; }});
  }
  Eigen::Index n = 0;
  for (const std::size_t length : series) n += static_cast<Eigen::Index>(length);
  const auto width = static_cast<Eigen::Index>(columns.size());
  if (n < 10 * width) return {{}, {}, {"slide: it hardly moves in these records; nothing estimated"}};
  Eigen::MatrixXd x(n, width);
  Eigen::VectorXd y(n);
  Eigen::Index row = 0;
  for (const Rows& r : all)
    for (std::size_t i = 0; i < r.size(); ++i, ++row) {
      y[row] = r.force[i] - model.given_mass_kg * r.acceleration[i] - model.given_viscous * r.speed[i];
      for (Eigen::Index c = 0; c < width; ++c) x(row, c) = columns[static_cast<std::size_t>(c)].value(r, i);
    }
  const LeastSquaresFit fit = solve_linear(x, y, series, static_cast<int>(slide_residual_memory_s / sample_s));
  Findings found;
  const std::string method = fmt::format("force balance, {} residuals of {:.2g} N", n, fit.rms);
  for (Eigen::Index c = 0; c < width; ++c) {
    const Column& column = columns[static_cast<std::size_t>(c)];
    found.estimates.push_back(make_estimate(column.name + suffix, column.unit, fit.x[c], fit.sigma(static_cast<int>(c)),
                                            fit.freedom, method));
  }
  ResidualPlot plot{"slide" + suffix + "_" + records.front()->part_name(),
                    records.front()->part_name() + ": forces on the slide",
                    "time [s]",
                    "force [N]",
                    {},
                    true};
  for (std::size_t i = 0; i < std::min<std::size_t>(all[0].size(), 500); ++i)
    plot.points.push_back({all[0].time_s[i], y[static_cast<Eigen::Index>(i)],
                           y[static_cast<Eigen::Index>(i)] - fit.residuals[static_cast<Eigen::Index>(i)]});
  found.plots.push_back(plot);
  return found;
}

}  // namespace

Findings estimate_slide(const std::vector<const Record*>& records, const ActuatorParameters& given,
                        double filter_delay_s, const SlideModel& model, const std::string& suffix) {
  double mass = model.mass ? given.equivalent_mass_kg() : model.given_mass_kg, coulomb = given.coulomb_friction_n;
  Findings found;
  for (int pass = 0; pass < 3; ++pass) {
    found = estimate_once(records, given, filter_delay_s, model, suffix, std::max(0.0, coulomb / mass));
    const Estimate* m = found.find("equivalent_mass_kg" + suffix);
    const Estimate* c = found.find("coulomb_friction_n" + suffix);
    if (m && m->value > 0) mass = m->value;
    if (c) coulomb = c->value;
  }
  return found;
}

Estimate payload_from(const Estimate& unloaded, const Estimate& loaded, const ActuatorParameters& given) {
  const double r = given.gear_radius_m() / given.arm_length_m, per_mass = r * r;
  return make_estimate("payload_mass_kg", "kg", per_mass * (loaded.value - unloaded.value),
                       per_mass * std::hypot(loaded.sigma, unloaded.sigma), std::min(loaded.freedom, unloaded.freedom),
                       "equivalent masses with and without it");
}

}  // namespace solenoid
