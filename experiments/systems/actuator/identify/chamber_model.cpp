// The model of a chamber's pressure: openings from commands, air, sensor's filter.
#include "core/signal/bessel.hpp"
#include "core/systems/actuator/dynamics.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/systems/actuator/identify/chambers.hpp"
#include "experiments/systems/actuator/identify/signals.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace solenoid {
namespace {

constexpr int substeps_per_sample = 4;

/// Mean opening of one coil over each substep: edges delayed each on its own; the last command wins.
std::vector<double> coil_openings(const Record& record, SwitchPattern coil, double rise_s, double fall_s) {
  struct Edge {
    double at;  // in substeps
    bool on;
  };
  std::vector<Edge> edges;
  const double per_s = substeps_per_sample / record.period_s;
  bool commanded = (record.coils[0] & coil) != 0;
  edges.push_back({0.0, commanded});
  for (std::size_t k = 1; k < record.size(); ++k) {
    const bool on = (record.coils[k] & coil) != 0;
    if (on == commanded) continue;
    commanded = on;
    const double at = static_cast<double>(k * substeps_per_sample) + per_s * (on ? rise_s : fall_s);
    while (edges.size() > 1 && edges.back().at >= at) edges.pop_back();
    edges.push_back({at, on});
  }
  std::vector<double> mean(record.size() * substeps_per_sample);
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

/// OpeningsOverTime of a chamber's two ways over each substep.
struct OpeningsOverTime {
  std::vector<double> fill, exhaust;
};

OpeningsOverTime chamber_openings(const Record& record, Chamber chamber, const ChamberParameters& p,
                                  const ActuatorParameters& given) {
  const ModeSet modes = valve_modes(record.valves, given);
  const std::size_t first = chamber == Chamber::a ? fill_a : fill_b;
  const std::size_t n = record.size() * substeps_per_sample;
  const double fill0 = modes.point(0)[first], exhaust0 = modes.point(0)[first + 1];
  OpeningsOverTime open{std::vector<double>(n, fill0), std::vector<double>(n, exhaust0)};
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

}  // namespace

ContinuousFlow continuous_flow(double fill_coefficient, double supply_pressure_pa, const ActuatorParameters& given) {
  const double b = given.critical_pressure_ratio;
  const double choked = fill_coefficient * std::sqrt((1 - b) * supply_pressure_pa);
  return {choked, choked / (given.atmospheric_pressure_pa * (1 / b - 1))};
}

const std::vector<double>& measured(const Record& r, Chamber chamber) {
  return chamber == Chamber::a ? r.pressure_a_pa : r.pressure_b_pa;
}

std::vector<double> predicted_pressure(const Record& record, const std::vector<double>& quiet_position_m,
                                       Chamber chamber, const ChamberParameters& p, const ActuatorParameters& given) {
  const bool is_a = chamber == Chamber::a;
  const OpeningsOverTime open = chamber_openings(record, chamber, p, given);
  const double area = is_a ? given.piston_area_a() : given.piston_area_b();
  const ChamberAir air(with(given, p), area);
  const auto length = [&](double y) { return is_a ? given.dead_length_a_m + y : given.dead_length_b_m - y; };
  const double dt = record.period_s / substeps_per_sample, k = given.heat_capacity_ratio;
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
    for (int i = 0; i < substeps_per_sample; ++i) {
      const double now = std::max(shortest, from + (to - from) * (i + 1) / substeps_per_sample);
      pressure *= power_near_one(before / now, k);
      const std::size_t s = t * substeps_per_sample + static_cast<std::size_t>(i);
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

}  // namespace solenoid
