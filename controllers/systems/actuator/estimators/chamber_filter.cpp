#include "controllers/systems/actuator/estimators/chamber_filter.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace solenoid {
namespace {

constexpr int lag_begin = 1;
constexpr double shortest_m = 1e-3;

/// A flow and its derivatives.
struct Flow {
  double value = 0.0, by_pressure = 0.0, by_supply = 0.0;
};

Flow fill_flow(const ChamberFilter::Chamber& c, double pressure, double supply) noexcept {
  if (pressure < c.critical * supply) return {c.choked_per_pa * supply, 0.0, c.choked_per_pa};
  const double head = supply - pressure;
  if (head < ChamberFilter::near_pa) {
    const double slope = c.fill_coefficient / std::sqrt(ChamberFilter::near_pa);
    // Nothing flows back. A little above the supply pressure that is believed, air that comes in all the same says that it is higher.
    if (head < -ChamberFilter::doubtful_pa) return {};
    return {slope * std::max(head, 0.0), head > 0.0 ? -slope : 0.0, slope};
  }
  const double root = std::sqrt(head), slope = c.fill_coefficient / (2 * root);
  return {c.fill_coefficient * root, -slope, slope};
}

Flow exhaust_flow(const ChamberFilter::Chamber& c, double pressure) noexcept {
  if (pressure > c.exhaust_choked_above_pa) return {-c.choked, 0.0, 0.0};
  return {c.discharge * (c.atmosphere_pa - pressure), -c.discharge, 0.0};
}

}  // namespace

ChamberFilter::Chamber::Chamber(const PneumaticActuator& model, const HealthTuning& t, bool b)
    : lag(t.filter_hz, t.tick_s), weights(lag.output()), held(lag.held_gain()), tuning(t), b_(b) {
  const ActuatorParameters& p = model.parameters();
  area = b ? p.piston_area_b() : p.piston_area_a();
  heating = p.heat_capacity_ratio * p.gas_constant * p.temperature_k / area;
  ratio = p.heat_capacity_ratio;
  gas_constant = p.gas_constant;
  wall_k = p.temperature_k;
  bore_m = p.bore_diameter_m;
  dead_m = b ? p.dead_length_b_m : p.dead_length_a_m;
  supply_pa = p.supply_pressure_pa;
  atmosphere_pa = p.atmospheric_pressure_pa;
  critical = p.critical_pressure_ratio;
  choked_per_pa = p.choked_flow / p.supply_pressure_pa;
  fill_coefficient = p.fill_coefficient;
  discharge = p.discharge_coefficient;
  exhaust_choked_above_pa = p.atmospheric_pressure_pa / p.critical_pressure_ratio;
  choked = p.choked_flow;
}

void ChamberFilter::start(const Chamber& c, double pressure_pa) noexcept {
  const HealthTuning& t = c.tuning;
  const auto square = [](double x) { return x * x; };
  mean_.setZero();
  temperature_k_ = c.wall_k;
  mean_[0] = pressure_pa;
  for (int i = 0; i < PressureLag::size; i += 2) mean_[lag_begin + i] = pressure_pa;
  mean_[fill_factor] = mean_[exhaust_factor] = 1.0;
  mean_[supply] = c.supply_pa;
  covariance_.setZero();
  covariance_(0, 0) = square(t.input_sigma_pa);
  covariance_.diagonal().segment<PressureLag::size>(lag_begin).setConstant(square(0.3 * t.input_sigma_pa));
  covariance_(fill_factor, fill_factor) = covariance_(exhaust_factor, exhaust_factor) = square(t.flow_sigma);
  covariance_(lateness, lateness) = square(t.delay_sigma);
  covariance_(supply, supply) = square(t.supply_sigma_pa);
  covariance_(unexplained, unexplained) = square(t.leak_sigma_pa_per_s);
}

void ChamberFilter::predict(const Chamber& c, const PathOpenings& open, double from_m, double to_m) noexcept {
  const HealthTuning& t = c.tuning;
  const double from = std::max(from_m, shortest_m), to = std::max(to_m, shortest_m), length = 0.5 * (from + to);
  const double per = t.tick_s * c.heating / length, stroke = c.ratio * (to - from) / length;
  const double p = mean_[0], late = mean_[lateness];
  const Flow fill = fill_flow(c, p, mean_[supply]), exhaust = exhaust_flow(c, p);
  const double s_fill = open.fill - late * open.fill_edges, s_exhaust = open.exhaust - late * open.exhaust_edges;
  // Air that leaves takes the chamber's temperature with it.
  const double warmth = temperature_k_ / c.wall_k;
  const double in = per * mean_[fill_factor] * s_fill * fill.value;
  const double out = per * mean_[exhaust_factor] * s_exhaust * exhaust.value * warmth;
  const double heat = heat_of_walls(c, length);
  const double next = std::max(0.0, p + in + out - stroke * p + heat + t.tick_s * mean_[unexplained]);
  const double flow = mean_[fill_factor] * s_fill * fill.value + mean_[exhaust_factor] * s_exhaust * exhaust.value;
  if (t.heat_transfer > 0.0)
    follow_temperature(c, next * to / std::max(p * from, 1.0), flow * t.tick_s, p * c.area * from);
  const double fade = std::exp(-t.tick_s / t.leak_memory_s);

  std::array<double, size> row{};
  row[0] = 1.0 - stroke +
           per * (mean_[fill_factor] * s_fill * fill.by_pressure +
                  mean_[exhaust_factor] * s_exhaust * exhaust.by_pressure * warmth);
  row[fill_factor] = per * s_fill * fill.value;
  row[exhaust_factor] = per * s_exhaust * exhaust.value * warmth;
  row[lateness] = -per * (mean_[fill_factor] * open.fill_edges * fill.value +
                          mean_[exhaust_factor] * open.exhaust_edges * exhaust.value * warmth);
  row[supply] = per * mean_[fill_factor] * s_fill * fill.by_supply;
  row[unexplained] = t.tick_s;

  double before[1] = {p}, after[1] = {next};
  c.lag.advance<1>(mean_.data() + lag_begin, before, after);
  mean_[0] = next;
  mean_[unexplained] *= fade;
  const double supply_fade = std::exp(-t.tick_s / t.supply_memory_s);
  mean_[supply] = c.supply_pa + supply_fade * (mean_[supply] - c.supply_pa);
  propagate(c, row, fade, supply_fade);

  const auto square = [](double x) { return x * x; };
  const double flows = square(in) + square(out);
  covariance_(0, 0) += square(t.white_pa) + square(t.flow_white) * flows + square(t.stroke_white * stroke * p);
  for (int i = 0; i < PressureLag::size; ++i)
    for (int j = 0; j < PressureLag::size; ++j)
      covariance_(lag_begin + i, lag_begin + j) +=
          square(t.input_sigma_pa) * c.held[static_cast<std::size_t>(i)] * c.held[static_cast<std::size_t>(j)];
  covariance_(fill_factor, fill_factor) += square(t.flow_drift) * t.tick_s;
  covariance_(exhaust_factor, exhaust_factor) += square(t.flow_drift) * t.tick_s;
  covariance_(supply, supply) += square(t.supply_sigma_pa) * (1.0 - supply_fade * supply_fade);
  covariance_(unexplained, unexplained) += square(t.leak_sigma_pa_per_s) * (1.0 - fade * fade);
}

/// What the walls' heat adds to the pressure in a tick [Pa].
double ChamberFilter::heat_of_walls(const Chamber& c, double length_m) const noexcept {
  const double wall_m2 = 2 * c.area + std::numbers::pi * c.bore_m * length_m;
  const double power = c.tuning.heat_transfer * wall_m2 * (c.wall_k - temperature_k_);
  return c.tuning.tick_s * (c.ratio - 1.0) * power / (c.area * length_m);
}

/// T ~ P V/m, of which P V grew by a factor and m by an amount of mass.
void ChamberFilter::follow_temperature(const Chamber& c, double growth, double mass_kg, double energy_j) noexcept {
  const double held_kg = std::max(energy_j, 1e-3) / (c.gas_constant * temperature_k_);
  const double more = std::max(1.0 + mass_kg / held_kg, 0.1);
  temperature_k_ = std::clamp(temperature_k_ * growth / more, 0.6 * c.wall_k, 1.6 * c.wall_k);
}

/// C <- F C F' as F (F C)' by rows; F never formed.
void ChamberFilter::propagate(const Chamber& c, const std::array<double, size>& row, double fade,
                              double supply_fade) noexcept {
  using Row = Eigen::Array<double, size, 1>;
  const auto by_rows = [&](Covariance& m) {  // columns are rows: it is symmetric, or its transpose is meant
    const auto at = [&](int i) { return Eigen::Map<Row>(m.data() + i * size); };
    const Row before = at(0);
    Row after = row[0] * before;
    for (const int i : {fill_factor, exhaust_factor, lateness, supply, unexplained})
      after += row[static_cast<std::size_t>(i)] * at(i);
    at(0) = after;
    c.lag.advance<size>(m.data() + lag_begin * size, before.data(), m.data());
    at(unexplained) *= fade;
    at(supply) *= supply_fade;
  };
  by_rows(covariance_);
  covariance_.transposeInPlace();
  by_rows(covariance_);
}

double ChamberFilter::expected(const Chamber& c) const noexcept {
  double sum = 0.0;
  for (int i = 0; i < PressureLag::size; ++i) sum += c.weights[static_cast<std::size_t>(i)] * mean_[lag_begin + i];
  return sum;
}

ChamberFilter::Innovation ChamberFilter::correct(const Chamber& c, double measured_pa) noexcept {
  const HealthTuning& t = c.tuning;
  Eigen::Matrix<double, size, 1> gain = Eigen::Matrix<double, size, 1>::Zero();
  for (int i = 0; i < PressureLag::size; ++i)
    gain += c.weights[static_cast<std::size_t>(i)] * covariance_.col(lag_begin + i);
  double variance = t.measured_sigma_pa * t.measured_sigma_pa;
  for (int i = 0; i < PressureLag::size; ++i) variance += c.weights[static_cast<std::size_t>(i)] * gain[lag_begin + i];
  const double innovation = measured_pa - expected(c), squared = innovation * innovation / variance;
  const double gate = t.gate_sigmas * t.gate_sigmas;
  const double weight = squared > gate ? std::sqrt(gate / squared) : 1.0;
  mean_ += gain * (weight * innovation / variance);
  covariance_ -= gain * gain.transpose() / variance;
  mean_[0] = std::max(0.0, mean_[0]);
  mean_[fill_factor] = std::clamp(mean_[fill_factor], t.least_flow, t.most_flow);
  mean_[exhaust_factor] = std::clamp(mean_[exhaust_factor], t.least_flow, t.most_flow);
  mean_[lateness] = std::clamp(mean_[lateness], -0.3, 0.3);
  mean_[supply] = std::clamp(mean_[supply], c.supply_pa - 40e3, c.supply_pa + 40e3);
  return {squared, variance};
}

}  // namespace solenoid
