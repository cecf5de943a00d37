#pragma once

#include "core/mpc/relaxation.hpp"
#include "core/systems/actuator/parameters.hpp"

#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace solenoid::test {

/// The slide of the recorded nonlinear programs: a duty a chamber and the motor force, tanh friction, no stops; one
/// step is five explicit Euler steps. Its "consumption" is the programs' price of a duty away from one half.
///
///     state (y [m], v [m/s], Pa, Pb [Pa])    switched (duty A, duty B)    continuous F [N]    output y [mm]
struct TrackingSlide {
  static constexpr std::size_t state_size = 4, switched_size = 2, continuous_size = 1, output_size = 1;
  static constexpr int substeps = 5;

  template <class S>
  Vector<S, 4> step(const Vector<S, 4>& x, const Vector<S, 2>& duty, const Vector<S, 1>& force, double dt) const {
    Vector<S, 4> z = x;
    for (int i = 0; i < substeps; ++i) z = euler<S>(z, duty, force[0], dt / substeps);
    return z;
  }
  template <class S>
  Vector<S, 1> output(const Vector<S, 4>& x) const {
    return {S(1000.0 * x[0])};
  }
  template <class S>
  S consumption(const Vector<S, 4>&, const Vector<S, 2>& duty) const {
    const S a = duty[0] - 0.5, b = duty[1] - 0.5;
    return a * a + b * b;
  }
  Vector<double, 4> state_scale() const { return {1e-3, 1e-1, 1e5, 1e5}; }

 private:
  template <class S>
  Vector<S, 4> euler(const Vector<S, 4>& x, const Vector<S, 2>& duty, const S& force, double h) const {
    using std::sin, std::tanh;
    const auto& [y, v, pa, pb] = x;
    const S flow_a = flow<S>(duty[0], pa), flow_b = flow<S>(duty[1], pb);
    const S friction = coulomb_ * tanh(S(v * (1.0 / 0.002))) + viscous_ * v;
    const S swing = sin(S(y * angle_per_m_));
    const S v_next = v + (h / mass_) * (area_a_ * pa - area_b_ * pb + force - friction - gravity_ * swing + weight_);
    const S pa_next = pa + h * ((krt_ / area_a_) * flow_a - ratio_ * (pa * v)) / (y + dead_a_);
    const S pb_next = pb + h * ((krt_ / area_b_) * flow_b + ratio_ * (pb * v)) / (dead_b_ - y);
    return {S(y + h * v), v_next, pa_next, pb_next};
  }

  /// duty * fill(P) + (1 - duty) * exhaust(P), with the jumps at the choking boundaries.
  template <class S>
  S flow(const S& duty, const S& pressure) const {
    using std::sqrt;
    const S head = supply_ - pressure;
    const S root = fill_ * sqrt(select(head < S(1e-3), S(1e-3), head));
    const S leak = discharge_ * (atmosphere_ - pressure);
    const S fill = select(pressure < S(critical_ * supply_), S(choked_), root);
    const S exhaust = select(pressure > S(atmosphere_ / critical_), S(-choked_), leak);
    return duty * (fill - exhaust) + exhaust;
  }

  ActuatorParameters p_;
  double area_a_ = 4.573e-4, area_b_ = 4.256e-4, mass_ = 15.69;  // as rounded where the programs were recorded
  double coulomb_ = p_.coulomb_friction_n, viscous_ = p_.viscous_friction, ratio_ = p_.heat_capacity_ratio,
         krt_ = ratio_ * p_.gas_constant * p_.temperature_k, dead_a_ = p_.dead_length_a_m, dead_b_ = p_.dead_length_b_m,
         angle_per_m_ = 2.0 / p_.gear_pitch_diameter_m, gravity_ = p_.gravity_torque_nm() / p_.gear_radius_m(),
         supply_ = p_.supply_pressure_pa, atmosphere_ = p_.atmospheric_pressure_pa,
         weight_ = p_.block_mass_kg * p_.gravity, choked_ = p_.choked_flow, fill_ = p_.fill_coefficient,
         discharge_ = p_.discharge_coefficient, critical_ = p_.critical_pressure_ratio;
};

/// One valve a chamber without delay, energised fills.
inline ModeSet duty_modes() {
  return {"duties",
          {{"A"}, {"B"}},
          {{"exhaust", 0}, {"fill A", 1}, {"fill B", 2}, {"fill", 3}},
          {0.0, 0.0},
          {{1.0, 0.0}, {0.0, 1.0}}};
}

struct RecordedNlp {
  Problem<TrackingSlide> problem;
  double best_known_cost = 0.0;
};

/// 20 stages of 5 ms; minimise sum (y - y_d)^2 [mm2] + 1e-3 sum ((d_a - 0.5)^2 + (d_b - 0.5)^2 + (F/8)^2).
inline RecordedNlp recorded_nlp(double time_s, const Vector<double, 4>& initial, double best_known_cost) {
  constexpr double stage_s = 0.005, price = 1e-3;
  Cost<TrackingSlide> cost;
  cost.tracking = {1.0};
  cost.consumption = price / stage_s;
  cost.continuous = {price / 64.0};
  Bounds<TrackingSlide> bounds;
  bounds.continuous_lower = {-8.0}, bounds.continuous_upper = {8.0};
  Problem<TrackingSlide> problem({}, duty_modes(), {stage_s, std::vector<int>(20, 1)}, cost, bounds);
  problem.initial = initial;
  for (std::size_t k = 0; k < 20; ++k)
    problem.reference[k] = {60.0 +
                            40.0 * std::cos(2.0 * std::numbers::pi * (time_s + stage_s * static_cast<double>(k + 1)))};
  return {std::move(problem), best_known_cost};
}

/// All instances of tests/data/nlp_tracking_n20.csv.
inline std::vector<RecordedNlp> recorded_nlps() {
  const std::string path = std::string(SOLENOID_SOURCE_DIR) + "/tests/data/nlp_tracking_n20.csv";
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  std::vector<RecordedNlp> all;
  while (std::getline(file, line)) {
    for (char& c : line) c = c == ',' ? ' ' : c;
    std::istringstream numbers(line);
    double t = 0.0, y = 0.0, v = 0.0, pa = 0.0, pb = 0.0, best = 0.0;
    if (!(numbers >> t >> y >> v >> pa >> pb >> best)) throw std::runtime_error(path + ": short line");
    all.push_back(recorded_nlp(t, {y, v, pa, pb}, best));
  }
  if (all.empty()) throw std::runtime_error(path + ": missing or empty");
  return all;
}

}  // namespace solenoid::test
