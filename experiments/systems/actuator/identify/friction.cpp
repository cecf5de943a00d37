#include "experiments/systems/actuator/identify/friction.hpp"

#include "core/systems/actuator/dynamics.hpp"
#include "experiments/base/printed_table.hpp"
#include "experiments/systems/actuator/identify/signals.hpp"
#include "experiments/systems/actuator/identify/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Dense>
#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double look_back_s = 0.7;  // of the position before it has moved
constexpr double force_mean_s = 0.5;
constexpr double smoothing_s = 0.02;  // of positions at a run's ends

struct Fit {
  double cost = std::numeric_limits<double>::infinity();
  Eigen::Vector3d x;
};

/// Position from `first` to `last`, constant to the moment `at`, then a parabola and a cubic: best for this moment.
Fit breakaway_at(const Record& r, std::size_t first, std::size_t last, double at) {
  const auto n = static_cast<Eigen::Index>(last - first);
  Eigen::MatrixXd x(n, 3);
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = r.period_s * std::max(0.0, static_cast<double>(first) + static_cast<double>(i) - at);
    x.row(i) << 1.0, t * t / 2, t * t * t / 6;
    y[i] = r.position_m[first + static_cast<std::size_t>(i)];
  }
  Fit fit;
  fit.x = (x.transpose() * x).ldlt().solve(x.transpose() * y);
  fit.cost = (y - x * fit.x).squaredNorm();
  return fit;
}

/// The best moment, in samples: a scan, then a golden section between its best one's neighbours.
double breakaway_moment(const Record& r, std::size_t first, std::size_t last) {
  constexpr double step = 5.0, golden = 0.6180339887;
  const auto cost = [&](double at) { return breakaway_at(r, first, last, at).cost; };
  double best = static_cast<double>(first) + 50;
  for (double at = best; at < static_cast<double>(last) - 20; at += step)
    if (cost(at) < cost(best)) best = at;
  double low = best - step, high = best + step;
  while (high - low > 0.05) {
    const double left = high - golden * (high - low), right = low + golden * (high - low);
    (cost(left) < cost(right) ? high : low) = cost(left) < cost(right) ? right : left;
  }
  return (low + high) / 2;
}

double motor_at(const Record& r, double at) {
  const auto k = static_cast<std::size_t>(at);
  return r.motor_n[k] + (r.motor_n[k + 1] - r.motor_n[k]) * (at - static_cast<double>(k));
}

double mean_cylinder_force(const Record& r, const PneumaticActuator& model, std::size_t first, std::size_t last) {
  double sum = 0;
  for (std::size_t t = first; t < last; ++t) sum += model.cylinder_force(r.pressure_a_pa[t], r.pressure_b_pa[t]);
  return sum / static_cast<double>(last - first);
}

Table42Reading read_table_4_2(const std::string& reading, double velocity_factor) {
  const PrintedTable table = PrintedTable::shipped("table_4-2_dynamic_friction");
  std::vector<SpeedRun> runs;
  double v[2] = {}, f[2] = {}, n[2] = {};
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const double speed = velocity_factor * table.number(i, "velocity_as_printed_m_per_s").value;
    const double force = table.number(i, "cylinder_force_N").value;
    const auto set = static_cast<std::size_t>(table.number(i, "set").value) - 1;
    runs.push_back({speed, force});
    v[set] += speed;
    f[set] += force;
    n[set] += 1;
  }
  const Findings found = friction_from_runs(runs, "Table 4-2, " + reading);
  Table42Reading r{reading, *found.find("coulomb_friction_n"), *found.find("viscous_friction"), 0, false};
  r.between_sets = (f[0] / n[0] - f[1] / n[1]) / (v[0] / n[0] - v[1] / n[1]);
  r.determines = r.viscous.low > 0 && r.viscous.high - r.viscous.low < r.viscous.value;
  return r;
}

}  // namespace

Findings static_friction_from_tests(const std::vector<double>& forces_n, const std::string& method) {
  if (forces_n.size() < 2) return {{}, {}, {"static friction: fewer than two breakaway tests; nothing estimated"}};
  const auto n = static_cast<double>(forces_n.size());
  Findings found;
  found.estimates.push_back(
      make_estimate("static_friction_n", "N", mean_of(forces_n), deviation_of(forces_n) / std::sqrt(n), n - 1, method));
  found.estimates.back().parameter = true;
  ResidualPlot plot{"static_friction", "static friction: breakaway tests", "test", "force [N]", {}, false};
  for (std::size_t i = 0; i < forces_n.size(); ++i)
    plot.points.push_back({static_cast<double>(i + 1), forces_n[i], found.estimates[0].value});
  found.plots.push_back(plot);
  return found;
}

Findings estimate_breakaway(const Record& r, const ActuatorParameters& given) {
  const PneumaticActuator model(given);
  std::vector<double> forces;
  std::size_t missed = 0;
  for (const Span& span : r.spans) {
    if (span.label != "ramp") continue;
    const auto back = static_cast<std::size_t>(look_back_s / r.period_s);
    const std::size_t first = span.last > span.first + back ? span.last - back : span.first;
    if (span.last - first < 100 || std::abs(r.position_m[span.last - 1] - r.position_m[span.first]) < 2e-4) {
      ++missed;  // it never moved
      continue;
    }
    const double at = breakaway_moment(r, first, span.last);
    const auto before = static_cast<std::size_t>(at), mean = static_cast<std::size_t>(force_mean_s / r.period_s);
    const std::size_t from = std::max(span.first, before > mean ? before - mean : 0);
    const double force = motor_at(r, at) + mean_cylinder_force(r, model, from, before + 1);
    forces.push_back(std::abs(force));
  }
  Findings found = static_friction_from_tests(forces, fmt::format("{} breakaways", forces.size()));
  if (missed > 0) found.remarks.push_back(fmt::format("static friction: in {} ramps the slide did not move", missed));
  return found;
}

Findings friction_from_runs(const std::vector<SpeedRun>& runs, const std::string& method) {
  const auto n = static_cast<Eigen::Index>(runs.size());
  if (n < 4) return {{}, {}, {"friction: fewer than four runs at constant speed; nothing estimated"}};
  Eigen::MatrixXd x(n, 2);
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    x.row(i) << 1.0, runs[static_cast<std::size_t>(i)].speed_m_s;
    y[i] = runs[static_cast<std::size_t>(i)].force_n;
  }
  // Short runs are noisier than long ones, so each run's own residual is its variance (White's covariance, lags 0).
  LeastSquaresFit fit = solve_linear(x, y, {runs.size()}, 0);
  Findings found;
  const double freedom = static_cast<double>(n - 2);
  found.estimates = {make_estimate("coulomb_friction_n", "N", fit.x[0], fit.sigma(0), freedom, method),
                     make_estimate("viscous_friction", "N s/m", fit.x[1], fit.sigma(1), freedom, method)};
  for (Estimate& e : found.estimates) e.parameter = true;
  ResidualPlot plot{"friction", "friction at constant speed", "speed [mm/s]", "force [N]", {}, false};
  for (Eigen::Index i = 0; i < n; ++i) plot.points.push_back({1e3 * x(i, 1), y[i], y[i] - fit.residuals[i]});
  std::ranges::sort(plot.points, {}, &ResidualPlot::Point::x);
  found.plots.push_back(plot);
  return found;
}

Findings estimate_constant_speeds(const Record& r, const ActuatorParameters& given, double mass_kg,
                                  double filter_delay_s) {
  const PneumaticActuator model(given);
  const auto lag = static_cast<std::size_t>(std::lround(filter_delay_s / r.period_s));
  const std::vector<double> smoothed = gaussian(r.position_m, r.period_s, smoothing_s);
  const std::vector<double> rate = gaussian(r.position_m, r.period_s, smoothing_s, 1);
  std::vector<SpeedRun> runs;
  for (const Span& span : r.spans) {
    if (span.label != "speed") continue;
    const std::size_t length = span.last - span.first;
    const std::size_t first = span.first + length * 4 / 10, last = span.last - length / 8;
    if (last + lag >= r.size() || last - first < 100) continue;
    // Momentum over the run: what the mean force did not do against friction is in the change of speed.
    const double seconds = r.period_s * static_cast<double>(last - first);
    const double speed = (smoothed[last] - smoothed[first]) / seconds;
    const double acceleration = (rate[last] - rate[first]) / seconds;
    double motor = 0;
    for (std::size_t t = first; t < last; ++t) motor += r.motor_n[t];
    motor /= static_cast<double>(last - first);
    // The pressures that belong to a position are measured `lag` samples after it.
    const double force = mean_cylinder_force(r, model, first + lag, last + lag) + motor - mass_kg * acceleration;
    const double direction = speed > 0 ? 1.0 : -1.0;
    runs.push_back({std::abs(speed), direction * force});
  }
  return friction_from_runs(runs, fmt::format("{} runs at constant speed", runs.size()));
}

Table42Verdict judge_table_4_2() {
  Table42Verdict verdict;
  verdict.readings = {read_table_4_2("as printed", 1.0), read_table_4_2("velocities a tenth of the printed ones", 0.1)};
  for (const Table42Reading& r : verdict.readings) verdict.determines = verdict.determines || r.determines;
  constexpr double text_viscous = 4.5, text_coulomb = 0.97;
  verdict.text = verdict.determines ? "Table 4-2 determines C_vf." : "Table 4-2 does not determine C_vf:";
  for (const Table42Reading& r : verdict.readings)
    verdict.text += fmt::format(
        "\n  {}: C_vf = {:.3g} N s/m, 95 % interval {:.3g} to {:.3g}; between the means of its two sets {:.3g}; F_cf = "
        "{:.3g} N ({:.3g} to {:.3g})",
        r.reading, r.viscous.value, r.viscous.low, r.viscous.high, r.between_sets, r.coulomb.value, r.coulomb.low,
        r.coulomb.high);
  if (!verdict.determines)
    verdict.text += fmt::format(
        "\n  No reading has an interval above zero, which is what friction is; the text's {} N s/m and {} N come from "
        "means (2.16 N, 2.10 N at 0.263, 0.250 m/s) that are not the table's.",
        text_viscous, text_coulomb);
  return verdict;
}

Estimate static_friction_of_table_4_1() {
  const PrintedTable table = PrintedTable::shipped("table_4-1_static_friction");
  std::vector<double> forces;
  for (std::size_t i = 0; i < table.rows(); ++i) forces.push_back(table.number(i, "static_friction_N").value);
  return static_friction_from_tests(forces, "Table 4-1").estimates.front();
}

}  // namespace solenoid
