#include "experiments/identify/chambers.hpp"

#include "core/actuator/dynamics.hpp"
#include "core/actuator/valves.hpp"
#include "core/config/reader.hpp"
#include "core/signal/bessel.hpp"
#include "experiments/identify/signals.hpp"
#include "experiments/identify/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>
#include <boost/math/distributions/fisher_f.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int substeps = 4;
constexpr int thinning = 4;                   // of residuals: 250 Hz holds all that a 50 Hz filter lets pass
constexpr double settle_s = 0.25;             // after which the unknown first pressure is forgotten
constexpr std::size_t least_residuals = 100;  // 0.4 s: less of a record tells nothing of valves
constexpr double usual_heat_transfer = 50.0;  // W/(m2 K), of air in small cylinders
constexpr double memory_s = 0.2;  // of residuals: the filter's 20 ms, and pressures that recover from a late edge

/// Mean opening of one coil over each substep: edges delayed each on its own; the last command wins.
std::vector<double> coil_openings(const Record& record, SwitchPattern coil, double rise_s, double fall_s) {
  struct Edge {
    double at;  // in substeps
    bool on;
  };
  std::vector<Edge> edges;
  const double per_s = substeps / record.period_s;
  bool commanded = (record.coils[0] & coil) != 0;
  edges.push_back({0.0, commanded});
  for (std::size_t k = 1; k < record.size(); ++k) {
    const bool on = (record.coils[k] & coil) != 0;
    if (on == commanded) continue;
    commanded = on;
    const double at = static_cast<double>(k * substeps) + per_s * (on ? rise_s : fall_s);
    while (edges.size() > 1 && edges.back().at >= at) edges.pop_back();
    edges.push_back({at, on});
  }
  std::vector<double> mean(record.size() * substeps);
  std::size_t e = 0;
  for (std::size_t i = 0; i < mean.size(); ++i) {
    const double from = static_cast<double>(i), to = from + 1;
    while (e + 1 < edges.size() && edges[e + 1].at <= from) ++e;
    double open = 0, since = from;
    for (std::size_t j = e; j < edges.size() && since < to; ++j) {
      const double until = j + 1 < edges.size() ? std::min(to, edges[j + 1].at) : to;
      if (edges[j].on) open += until - since;
      since = until;
    }
    mean[i] = open;
  }
  return mean;
}

/// Openings of a chamber's two ways over each substep.
struct Openings {
  std::vector<double> fill, exhaust;
};

Openings chamber_openings(const Record& record, Chamber chamber, const ChamberParameters& p,
                          const ActuatorParameters& given) {
  const ModeSet modes = valve_modes(record.valves, given);
  const std::size_t first = chamber == Chamber::a ? fill_a : fill_b;
  const std::size_t n = record.size() * substeps;
  const double fill0 = modes.point(0)[first], exhaust0 = modes.point(0)[first + 1];
  Openings open{std::vector<double>(n, fill0), std::vector<double>(n, exhaust0)};
  for (int c = 0; c < modes.switch_count(); ++c) {
    const SwitchPattern coil = SwitchPattern{1} << c;
    const double fill = modes.point(coil)[first] - fill0, exhaust = modes.point(coil)[first + 1] - exhaust0;
    if (fill == 0 && exhaust == 0) continue;
    const std::vector<double> mean = coil_openings(record, coil, p.energise_delay_s, p.deenergise_delay_s);
    for (std::size_t i = 0; i < n; ++i) {
      open.fill[i] += fill * mean[i];
      open.exhaust[i] += exhaust * mean[i];
    }
  }
  return open;
}

/// The air of one chamber under known volume: dP/dt by flow alone, cut where the flow law may jump.
class ChamberAir {
 public:
  ChamberAir(const ActuatorParameters& parameters, double area_m2)
      : model_(parameters),
        edges_{parameters.critical_pressure_ratio * parameters.supply_pressure_pa,
               parameters.atmospheric_pressure_pa / parameters.critical_pressure_ratio},
        heating_(parameters.heat_capacity_ratio * parameters.gas_constant * parameters.temperature_k / area_m2) {
    if (edges_[0] > edges_[1]) std::swap(edges_[0], edges_[1]);
  }

  /// How flow raises the pressure over a step: inflow by `gain`, outflow by gain times `cooled`, the walls by `heat`.
  struct Step {
    double gain = 0, cooled = 1, heat = 0;
  };

  /// After `dt` at constant chamber length.
  double advance(double pressure, const Step& gain, double fill, double exhaust, double dt) const {
    for (int pieces = 0; pieces < 4 && dt > 0; ++pieces) {
      const auto [low, high] = cell(pressure, rate(pressure, gain, fill, exhaust));
      const double next = midpoint(pressure, low, high, gain, fill, exhaust, dt);
      if (next >= low && next <= high) return next;
      // Only as far as the edge of this cell, then on from just beyond it.
      const double edge = next > high ? high : low, share = (edge - pressure) / (next - pressure);
      dt *= 1 - share;
      pressure = next > high ? edge * (1 + 1e-12) : edge * (1 - 1e-12);
    }
    return pressure;
  }

  Step step(double length_m) const { return {heating_ / length_m, 1.0, 0.0}; }
  double mass_flow(double p, double fill, double exhaust) const {
    return fill * model_.fill_flow<double>(p) + exhaust * model_.exhaust_flow<double>(p);
  }

 private:
  double rate(double p, const Step& s, double fill, double exhaust) const {
    const double out = exhaust * model_.exhaust_flow<double>(p);
    return s.gain * (fill * model_.fill_flow<double>(p) + (out < 0 ? s.cooled * out : out)) + s.heat;
  }
  std::pair<double, double> cell(double p, double) const {
    if (p < edges_[0]) return {-1e9, edges_[0]};
    if (p <= edges_[1]) return {edges_[0], edges_[1]};
    return {edges_[1], 1e9};
  }
  double midpoint(double p, double low, double high, const Step& gain, double fill, double exhaust, double dt) const {
    const double inside = 1e-9;
    const auto kept = [&](double q) { return std::clamp(q, low * (1 + inside), high * (1 - inside)); };
    const double half = kept(p + dt / 2 * rate(kept(p), gain, fill, exhaust));
    return p + dt * rate(half, gain, fill, exhaust);
  }

  PneumaticActuator model_;
  std::array<double, 2> edges_;
  double heating_;
};

/// r^k for r near one, to its cube.
double power_near_one(double r, double k) {
  const double d = r - 1;
  return 1 + d * (k + d * (k - 1) / 2 * (k + d * k * (k - 2) / 3));
}

ActuatorParameters with(ActuatorParameters a, const ChamberParameters& p) {
  a.fill_coefficient = p.fill_coefficient;
  a.discharge_coefficient = p.discharge_coefficient;
  a.choked_flow = p.choked_flow;
  a.supply_pressure_pa = p.supply_pressure_pa;
  return a;
}

const std::vector<double>& measured(const Record& r, Chamber chamber) {
  return chamber == Chamber::a ? r.pressure_a_pa : r.pressure_b_pa;
}

/// The free numbers in the order of the least-squares problem.
enum Free : Index { supply = 0, rising, falling, filter, filling, discharging, choking };

/// What the model of the air is.
struct AirLaw {
  FlowContinuity continuity;
  bool walls;  ///< heat transfer, free
  Index size() const { return (continuity == FlowContinuity::continuous ? 5 : 7) + (walls ? 1 : 0); }
};

struct Problem {
  std::vector<const Record*> records;
  std::vector<std::vector<double>> quiet;  // their positions
  ActuatorParameters given;
  AirLaw law;

  ChamberParameters parameters(const VectorXd& x) const {
    ChamberParameters p;
    p.supply_pressure_pa = x[supply];
    p.energise_delay_s = x[rising];
    p.deenergise_delay_s = x[falling];
    p.filter_delay_s = std::max(1e-3, x[filter]);
    p.fill_coefficient = x[filling];
    const double b = given.critical_pressure_ratio;
    p.choked_flow = p.fill_coefficient * std::sqrt((1 - b) * p.supply_pressure_pa);
    p.discharge_coefficient = p.choked_flow / (given.atmospheric_pressure_pa * (1 / b - 1));
    if (law.walls) p.heat_transfer = x[law.size() - 1];
    if (law.continuity == FlowContinuity::continuous) return p;
    p.discharge_coefficient = x[discharging];
    p.choked_flow = x[choking];
    return p;
  }

  static std::size_t residuals_of(const Record& r) {
    const auto settle = static_cast<std::size_t>(settle_s / r.period_s);
    return r.size() <= settle ? 0 : (r.size() - settle + thinning - 1) / thinning;
  }

  void residuals(const VectorXd& x, VectorXd& out) const {
    const ChamberParameters p = parameters(x);
    Index i = 0;
    for (std::size_t n = 0; n < records.size(); ++n)
      for (const Chamber chamber : {Chamber::a, Chamber::b}) {
        const Record* r = records[n];
        const std::vector<double> predicted = predicted_pressure(*records[n], quiet[n], chamber, p, given);
        const std::vector<double>& seen = measured(*r, chamber);
        for (std::size_t t = static_cast<std::size_t>(settle_s / r->period_s); t < r->size(); t += thinning)
          out[i++] = seen[t] - predicted[t];
      }
  }
};

LeastSquaresFit fit_chambers(const Problem& problem, const VectorXd* from = nullptr) {
  LeastSquares ls;
  ls.residuals = [&](const VectorXd& x, VectorXd& r) { problem.residuals(x, r); };
  for (const Record* r : problem.records) ls.series.insert(ls.series.end(), 2, Problem::residuals_of(*r));
  const ActuatorParameters& g = problem.given;
  std::vector<double> start = {g.supply_pressure_pa, g.energise_delay_s, g.deenergise_delay_s,
                               ChamberParameters{}.filter_delay_s, g.fill_coefficient};
  std::vector<double> scale = {g.supply_pressure_pa, 1e-2, 1e-2, 1e-2, g.fill_coefficient};
  if (problem.law.continuity == FlowContinuity::free)
    for (const double value : {g.discharge_coefficient, g.choked_flow}) {
      start.push_back(value);
      scale.push_back(value);
    }
  if (problem.law.walls) {
    start.push_back(usual_heat_transfer);
    scale.push_back(usual_heat_transfer);
  }
  ls.start = Eigen::Map<VectorXd>(start.data(), problem.law.size());
  ls.scale = Eigen::Map<VectorXd>(scale.data(), problem.law.size());
  if (from) ls.start = from->head(problem.law.size());
  ls.lags = static_cast<int>(memory_s / (problem.records.front()->period_s * thinning));
  return solve_least_squares(ls);
}

/// Value and standard error of a function of the fitted numbers, by its gradient.
template <class Function>
std::pair<double, double> derived(const LeastSquaresFit& fit, const VectorXd& scale, Function f) {
  VectorXd gradient(fit.x.size());
  for (Index i = 0; i < fit.x.size(); ++i) {
    VectorXd ahead = fit.x, behind = fit.x;
    ahead[i] += 1e-5 * scale[i];
    behind[i] -= 1e-5 * scale[i];
    gradient[i] = (f(ahead) - f(behind)) / (2e-5 * scale[i]);
  }
  return {f(fit.x), std::sqrt(gradient.dot(fit.covariance * gradient))};
}

/// Wald's statistic of the two equations of continuity on the free fit, and its probability by chance; 1 where the data
/// say nothing of them (no edge of one valve, a chamber that never chokes).
double chance_of_continuity(const Problem& free, const LeastSquaresFit& fit) {
  const double b = free.given.critical_pressure_ratio, p0 = free.given.atmospheric_pressure_pa;
  const auto gaps = [&](const VectorXd& x) {
    return Eigen::Vector2d(std::log(x[choking] / (x[filling] * std::sqrt((1 - b) * x[supply]))),
                           std::log(x[choking] / (x[discharging] * p0 * (1 / b - 1))));
  };
  MatrixXd gradient(2, fit.x.size());
  for (Index i = 0; i < fit.x.size(); ++i) {
    VectorXd ahead = fit.x, behind = fit.x;
    const double h = 1e-5 * std::abs(fit.x[i]);
    ahead[i] += h;
    behind[i] -= h;
    gradient.col(i) = (gaps(ahead) - gaps(behind)) / (2 * h);
  }
  const Eigen::Matrix2d covariance = gradient * fit.covariance * gradient.transpose();
  const Eigen::Vector2d gap = gaps(fit.x);
  const double f = gap.dot(covariance.inverse() * gap) / 2;
  if (!(f >= 0) || !std::isfinite(f)) return 1.0;
  return 1 - boost::math::cdf(boost::math::fisher_f(2, std::max(1.0, fit.freedom)), f);
}

ResidualPlot pressure_plot(const Record& r, Chamber chamber, const ChamberParameters& p,
                           const ActuatorParameters& given) {
  ResidualPlot plot{"pressure_" + std::string(chamber == Chamber::a ? "a_" : "b_") + r.name,
                    fmt::format("{}: pressure of chamber {}", r.name, chamber == Chamber::a ? "A" : "B"),
                    "time [s]",
                    "pressure [kPa]",
                    {},
                    true};
  const std::vector<double> predicted =
      predicted_pressure(r, quiet_position(r.position_m, r.period_s), chamber, p, given);
  const std::size_t first = static_cast<std::size_t>(settle_s / r.period_s);
  const std::size_t last = std::min(r.size(), first + static_cast<std::size_t>(1.5 / r.period_s));
  for (std::size_t t = first; t < last; ++t)
    plot.points.push_back({static_cast<double>(t) * r.period_s, 1e-3 * measured(r, chamber)[t], 1e-3 * predicted[t]});
  return plot;
}

bool valves_switch(const Record& r) {
  return std::ranges::adjacent_find(r.coils, std::ranges::not_equal_to()) != r.coils.end();
}

Findings findings(const Problem& problem, const LeastSquaresFit& fit) {
  Findings found;
  if (!fit.converged) {
    found.remarks.push_back(
        "valves: the search for their values did not converge: these records do not determine them");
    return found;
  }
  const std::string method =
      fmt::format("{} from {} records, {} residuals of {:.0f} Pa",
                  problem.law.continuity == FlowContinuity::continuous ? "continuous flow" : "free flow",
                  problem.records.size(), fit.residuals.size(), fit.rms);
  VectorXd scale = fit.x.cwiseAbs();
  const auto add = [&](const char* name, const char* unit, double ChamberParameters::*field, bool parameter) {
    const auto [value, sigma] = derived(fit, scale, [&](const VectorXd& x) { return problem.parameters(x).*field; });
    found.estimates.push_back(make_estimate(name, unit, value, sigma, fit.freedom, method));
    found.estimates.back().parameter = parameter;
  };
  add("fill_coefficient", "kg/(s Pa^0.5)", &ChamberParameters::fill_coefficient, true);
  add("discharge_coefficient", "kg/(s Pa)", &ChamberParameters::discharge_coefficient, true);
  add("choked_flow", "kg/s", &ChamberParameters::choked_flow, true);
  add("supply_pressure_pa", "Pa", &ChamberParameters::supply_pressure_pa, true);
  add("energise_delay_s", "s", &ChamberParameters::energise_delay_s, true);
  add("deenergise_delay_s", "s", &ChamberParameters::deenergise_delay_s, true);
  add("pressure_filter_delay_s", "s", &ChamberParameters::filter_delay_s, false);
  for (const Record* r : problem.records)
    for (const Chamber chamber : {Chamber::a, Chamber::b})
      found.plots.push_back(pressure_plot(*r, chamber, problem.parameters(fit.x), problem.given));
  return found;
}

Problem problem_of(const std::vector<const Record*>& records, const ActuatorParameters& given, AirLaw law) {
  Problem problem{{}, {}, given, law};
  for (const Record* r : records)
    if (Problem::residuals_of(*r) >= least_residuals && valves_switch(*r)) {
      problem.records.push_back(r);
      problem.quiet.push_back(quiet_position(r->position_m, r->period_s));
    }
  return problem;
}

}  // namespace

std::vector<double> predicted_pressure(const Record& record, const std::vector<double>& quiet_position_m,
                                       Chamber chamber, const ChamberParameters& p, const ActuatorParameters& given) {
  const bool is_a = chamber == Chamber::a;
  const Openings open = chamber_openings(record, chamber, p, given);
  const double area = is_a ? given.piston_area_a() : given.piston_area_b();
  const ChamberAir air(with(given, p), area);
  const auto length = [&](double y) { return is_a ? given.dead_length_a_m + y : given.dead_length_b_m - y; };
  const double dt = record.period_s / substeps, k = given.heat_capacity_ratio;
  const double shortest = given.end_clearance_m;
  const std::vector<double>& y = quiet_position_m;
  Bessel8 bessel(bessel_cutoff_hz(p.filter_delay_s), 1 / dt);
  std::vector<double> out(record.size());
  double pressure = measured(record, chamber)[0], filtered = pressure;
  bessel.reset(pressure);
  double before = std::max(shortest, length(y[0]));
  double mass = pressure * area * before / (given.gas_constant * given.temperature_k);
  for (std::size_t t = 0; t < record.size(); ++t) {
    out[t] = filtered;
    if (t + 1 == record.size()) break;
    const double from = length(y[t]), to = length(y[t + 1]);
    for (int i = 0; i < substeps; ++i) {
      const double now = std::max(shortest, from + (to - from) * (i + 1) / substeps);
      pressure *= power_near_one(before / now, k);
      const std::size_t s = t * substeps + static_cast<std::size_t>(i);
      ChamberAir::Step step = air.step(now);
      if (p.heat_transfer) {
        const double kelvin = pressure * area * now / (mass * given.gas_constant);
        const double wall = 2 * area + std::numbers::pi * given.bore_diameter_m * now;
        step.cooled = kelvin / given.temperature_k;
        step.heat = (k - 1) * *p.heat_transfer * wall * (given.temperature_k - kelvin) / (area * now);
      }
      const double old = pressure;
      pressure = air.advance(pressure, step, open.fill[s], open.exhaust[s], dt);
      if (p.heat_transfer) mass += dt * air.mass_flow((old + pressure) / 2, open.fill[s], open.exhaust[s]);
      filtered = bessel.step(pressure);
      before = now;
    }
  }
  return out;
}

Findings estimate_chambers(const std::vector<const Record*>& records, const ActuatorParameters& given,
                           FlowContinuity continuity) {
  const Problem problem = problem_of(records, given, {continuity, false});
  if (problem.records.empty()) return {};
  return findings(problem, fit_chambers(problem));
}

Findings estimate_chambers(const std::vector<const Record*>& records, const ActuatorParameters& given,
                           double noise_pa) {
  Problem problem = problem_of(records, given, {FlowContinuity::free, false});
  if (problem.records.empty()) return {};
  LeastSquaresFit fit = fit_chambers(problem);
  std::string walls;
  if (fit.rms > 1.5 * noise_pa) {
    Problem with_walls = problem;
    with_walls.law.walls = true;
    const LeastSquaresFit other = fit_chambers(with_walls);
    if (other.rms < fit.rms / 1.5) {
      walls = fmt::format(
          "valves: heat goes through the chambers' walls, {:.3g} W/(m2 K); without it residuals are {:.0f} Pa, with it "
          "{:.0f} Pa",
          other.x[with_walls.law.size() - 1], fit.rms, other.rms);
      problem = with_walls;
      fit = other;
    }
  }
  const double chance = chance_of_continuity(problem, fit);
  const bool refused = chance < 0.05;
  if (!refused) {
    const VectorXd start = fit.x;
    problem.law.continuity = FlowContinuity::continuous;
    fit = fit_chambers(problem, problem.law.walls ? nullptr : &start);
  }
  Findings found = findings(problem, fit);
  if (!fit.converged) return found;
  if (!walls.empty()) found.remarks.push_back(walls);
  found.remarks.push_back(
      fmt::format("valves: a flow that does not jump where it chokes is {}refused (Wald's test: chance {:.2g}); {}",
                  refused ? "" : "not ", chance,
                  refused ? "c_fill, c_dis and the choked flow are estimated each on its own"
                          : "c_dis and the choked flow follow from c_fill and the supply pressure"));
  return found;
}

}  // namespace solenoid
