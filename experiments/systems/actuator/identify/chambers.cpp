#include "experiments/systems/actuator/identify/chambers.hpp"

#include "experiments/systems/actuator/identify/signals.hpp"
#include "experiments/systems/actuator/identify/statistics.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <boost/math/distributions/fisher_f.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int thinning = 4;                   // of residuals: 250 Hz holds all that a 50 Hz filter lets pass
constexpr double settle_s = 0.25;             // after which the unknown first pressure is forgotten
constexpr std::size_t least_residuals = 100;  // 0.4 s: less of a record tells nothing of valves
constexpr double usual_heat_transfer = 50.0;  // W/(m2 K), of air in small cylinders
constexpr double residual_memory_s =
    0.2;  // of residuals: the filter's 20 ms, and pressures that recover from a late edge

/// The free numbers in the order of the least-squares problem.
enum Free : Index { supply = 0, rising, falling, filter, filling, discharging, choking };

/// What the model of the air is.
struct AirLaw {
  FlowContinuity continuity;
  bool walls;  ///< heat transfer, free
  Index size() const { return (continuity == FlowContinuity::continuous ? 5 : 7) + (walls ? 1 : 0); }
};

struct ChamberProblem {
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
    const ContinuousFlow flow = continuous_flow(p.fill_coefficient, p.supply_pressure_pa, given);
    p.choked_flow = flow.choked_flow;
    p.discharge_coefficient = flow.discharge_coefficient;
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

LeastSquaresFit fit_chambers(const ChamberProblem& problem, const VectorXd* from = nullptr) {
  LeastSquares ls;
  ls.residuals = [&](const VectorXd& x, VectorXd& r) { problem.residuals(x, r); };
  for (const Record* r : problem.records) ls.series.insert(ls.series.end(), 2, ChamberProblem::residuals_of(*r));
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
  ls.lags = static_cast<int>(residual_memory_s / (problem.records.front()->period_s * thinning));
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
double chance_of_continuity(const ChamberProblem& free, const LeastSquaresFit& fit) {
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
  ResidualPlot plot{"pressure_" + std::string(chamber == Chamber::a ? "a_" : "b_") + r.part_name(),
                    fmt::format("{}: pressure of chamber {}", r.part_name(), chamber == Chamber::a ? "A" : "B"),
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

Findings findings(const ChamberProblem& problem, const LeastSquaresFit& fit) {
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

ChamberProblem problem_of(const std::vector<const Record*>& records, const ActuatorParameters& given, AirLaw law) {
  ChamberProblem problem{{}, {}, given, law};
  for (const Record* r : records)
    if (ChamberProblem::residuals_of(*r) >= least_residuals && valves_switch(*r)) {
      problem.records.push_back(r);
      problem.quiet.push_back(quiet_position(r->position_m, r->period_s));
    }
  return problem;
}

}  // namespace

Findings estimate_chambers(const std::vector<const Record*>& records, const ActuatorParameters& given,
                           FlowContinuity continuity) {
  const ChamberProblem problem = problem_of(records, given, {continuity, false});
  if (problem.records.empty()) return {};
  return findings(problem, fit_chambers(problem));
}

Findings estimate_chambers(const std::vector<const Record*>& records, const ActuatorParameters& given,
                           double noise_pa) {
  ChamberProblem problem = problem_of(records, given, {FlowContinuity::free, false});
  if (problem.records.empty()) return {};
  LeastSquaresFit fit = fit_chambers(problem);
  std::string walls;
  if (fit.rms > 1.5 * noise_pa) {
    ChamberProblem with_walls = problem;
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
