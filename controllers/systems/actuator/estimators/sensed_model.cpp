#include "controllers/systems/actuator/estimators/sensed_model.hpp"

#include "controllers/estimators/sensitivity.hpp"
#include "core/systems/actuator/signals.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace solenoid {
namespace {

/// Slower than this the Jacobian is taken: the velocity at which one tick of any force cannot reverse the slide.
constexpr double reversal_speed = 0.01;
/// Keeps linearisations off the root of the fill flow, whose slope has no bound just below supply pressure.
constexpr double supply_margin_pa = 800.0;
/// The velocity's standard deviation below which friction's statistical slope grows no further.
constexpr double least_velocity_sigma = 1e-3;

StateOf<LoadedActuator> core_of(const Belief::State& mean) {
  StateOf<LoadedActuator> x;
  std::copy_n(mean.data(), Belief::core, x.begin());
  return x;
}

template <std::size_t size>
void place(const std::array<double, size>& values, double factor, int at, Belief::State& row) {
  for (std::size_t i = 0; i < size; ++i) row[at + static_cast<int>(i)] += factor * values[i];
}

/// Share of the stationary variance that a first-order process with this memory gains in a tick.
double renewed(double memory_s, double tick_s) {
  const double keep = 1.0 - tick_s / memory_s;
  return 1.0 - keep * keep;
}

}  // namespace

SensedModel::SensedModel(const PneumaticActuator& model, const EstimatorTuning& t)
    : model_(model, t.memory, t.residual),
      tuning_(t),
      lag_(t.pressure_filter_hz > 0 ? t.pressure_filter_hz : 50.0, tuning_.tick_s),
      position_variance_(t.position_variance()),
      pressure_variance_(t.pressure_sigma_pa * t.pressure_sigma_pa) {
  sensors_.fill(Belief::State::Zero());
  sensors_[0][position] = 1.0;
  pressure_a_noise_ = pressure_b_noise_ = input_a_noise_ = input_b_noise_ = Belief::State::Zero();
  if (t.pressure_filter_hz > 0) {
    place(lag_.output(), 1.0, Belief::lag_a, sensors_[1]);
    place(lag_.output(), 1.0, Belief::lag_b, sensors_[2]);
    place(lag_.held_gain(), t.pressure_input_sigma_pa, Belief::lag_a, input_a_noise_);
    place(lag_.held_gain(), t.pressure_input_sigma_pa, Belief::lag_b, input_b_noise_);
  } else {
    sensors_[1][pressure_a] = sensors_[2][pressure_b] = 1.0;
    pressure_variance_ += t.pressure_input_sigma_pa * t.pressure_input_sigma_pa;
  }
  const double drift = t.pressure_drift_pa * std::sqrt(tuning_.tick_s);
  pressure_a_noise_[pressure_a] = pressure_b_noise_[pressure_b] = drift;
  place(lag_.late_gain(), drift, Belief::lag_a, pressure_a_noise_);
  place(lag_.late_gain(), drift, Belief::lag_b, pressure_b_noise_);

  const auto square = [](double x) { return x * x; };
  core_noise_.setZero();
  core_noise_[position] = square(1e-8);
  core_noise_[velocity] = square(tuning_.tick_s / model.parameters().equivalent_mass_kg() * t.force_white_n);
  core_noise_[disturbance] = square(t.force_sigma_n) * renewed(t.memory.force_s, t.tick_s);
  core_noise_[payload] = t.payload_sigma_kg > 0 ? square(t.payload_drift) * tuning_.tick_s : 0.0;
  core_noise_[flow_factor] = square(t.flow_sigma) * renewed(t.memory.flow_s, t.tick_s);
  core_noise_[friction_factor] = square(t.friction_sigma) * renewed(t.memory.friction_s, t.tick_s);
}

void SensedModel::advance(Belief::State& mean, bool& at_rest, const SwitchedOf<LoadedActuator>& opening,
                          double motor_n) const noexcept {
  const auto x = core_of(mean);
  auto next = model_.step<double>(x, opening, {motor_n}, tuning_.tick_s);
  if (at_rest && next[velocity] == 0.0) {
    // A correction left a velocity of either sign where the slide rests: whether it moves off is for the forces to say.
    auto resting = x;
    resting[velocity] = 0.0;
    const double moved_off = model_.step<double>(resting, opening, {motor_n}, tuning_.tick_s)[velocity];
    if (moved_off != 0.0) next[velocity] = moved_off + x[velocity];
  }
  at_rest = next[velocity] == 0.0;
  lag_.advance<1>(mean.data() + Belief::lag_a, &mean[pressure_a], &next[pressure_a]);
  lag_.advance<1>(mean.data() + Belief::lag_b, &mean[pressure_b], &next[pressure_b]);
  std::copy(next.begin(), next.end(), mean.data());
}

void SensedModel::linearise(const Belief::State& mean, double velocity_sigma, const SwitchedOf<LoadedActuator>& opening,
                            double motor_n, Jacobian& jacobian, double& unknown_variance) const noexcept {
  const PneumaticActuator& actuator = model_.actuator();
  auto x = core_of(mean);
  const double v = x[velocity];
  if (std::abs(v) < reversal_speed) x[velocity] = v < 0 ? -reversal_speed : reversal_speed;
  const ActuatorParameters& p = actuator.parameters();
  for (const std::size_t i : {pressure_a, pressure_b})
    if (x[i] < p.supply_pressure_pa) x[i] = std::min(x[i], p.supply_pressure_pa - supply_margin_pa);
  const double ahead = x[position] + 2 * tuning_.tick_s * v;
  const bool stopping = ahead < p.position_min_m() || ahead > p.position_max_m();
  const double margin_m =
      1e-4 + tuning_.tick_s * std::abs(x[velocity]);  // an end stop would make position and speed certain
  x[position] = std::clamp(x[position], p.position_min_m() + margin_m, p.position_max_m() - margin_m);
  const double gained =
      solenoid::linearise(model_, x, opening, {motor_n}, tuning_.tick_s, jacobian)[velocity] - x[velocity];

  // sign(v) of v ~ N(v, s^2) has mean erf(v / (s sqrt 2)) and that mean the slope below: describing-function theory.
  const double s = std::max(velocity_sigma, least_velocity_sigma), ratio = v / s;
  const double mean_sign = std::erf(ratio / std::numbers::sqrt2);
  const double bell = std::sqrt(2 / std::numbers::pi) * std::exp(-0.5 * ratio * ratio);
  const auto own = actuator.conditions<double>(x[payload], x[disturbance], x[friction_factor]);
  const double change = tuning_.tick_s * own.inverse_mass * own.coulomb;
  jacobian(velocity, velocity) -= std::min(change * bell / s, 0.9);
  jacobian(velocity, friction_factor) *= std::abs(mean_sign);
  unknown_variance = change * change * std::max(0.0, 1.0 - mean_sign * mean_sign - bell * bell);
  if (std::abs(v) < std::abs(gained)) unknown_variance += gained * gained / 12;  // a reversal stops inside the tick
  if (stopping) unknown_variance += v * v;  // an impact a tick sooner or later is the whole velocity
}

void SensedModel::add_process_noise(double unknown_variance, Belief::Covariance& covariance) const noexcept {
  covariance.diagonal().head<Belief::core>() += core_noise_;
  covariance(velocity, velocity) += unknown_variance;
  for (const auto* direction : {&pressure_a_noise_, &pressure_b_noise_, &input_a_noise_, &input_b_noise_})
    covariance.noalias() += *direction * direction->transpose();
}

void SensedModel::start(const Measurement& sensors, bool at_rest, Belief& belief) const noexcept {
  const double pressures[] = {sensors.value[pressure_a_channel], sensors.value[pressure_b_channel]};
  belief.mean.setZero();
  belief.mean[position] = sensors.value[position_channel];
  belief.mean[payload] = tuning_.payload_mean_kg;
  belief.mean[flow_factor] = belief.mean[friction_factor] = 1.0;
  belief.covariance.setZero();
  Eigen::Matrix<double, Belief::core, 1> sigma;
  sigma << std::sqrt(position_variance_), at_rest ? 1e-3 : 0.2, 0.0, 0.0, tuning_.force_sigma_n,
      tuning_.payload_sigma_kg, tuning_.flow_sigma, tuning_.friction_sigma;
  belief.covariance.diagonal().head<Belief::core>() = sigma.cwiseAbs2();
  for (const int chamber : {0, 1}) {
    const int lag = chamber == 0 ? Belief::lag_a : Belief::lag_b;
    Belief::State settled = Belief::State::Zero();
    settled[pressure_a + static_cast<std::size_t>(chamber)] = 1.0;
    for (int i = 0; i < PressureLag::size; i += 2) settled[lag + i] = 1.0;
    belief.mean += pressures[chamber] * settled;
    const double pressure_sigma_pa = at_rest ? 500.0 : 5e4, lag_sigma_pa = at_rest ? 20.0 : 5e3;
    belief.covariance.noalias() += pressure_sigma_pa * pressure_sigma_pa * settled * settled.transpose();
    belief.covariance.diagonal().segment<PressureLag::size>(lag).array() += lag_sigma_pa * lag_sigma_pa;
  }
}

void SensedModel::confine(Belief::State& mean) const noexcept {
  const ActuatorParameters& p = model_.actuator().parameters();
  mean[position] = std::clamp(mean[position], p.position_min_m(), p.position_max_m());
  mean[velocity] = std::clamp(mean[velocity], -5.0, 5.0);
  mean[pressure_a] = std::clamp(mean[pressure_a], 1e4, 4e6);
  mean[pressure_b] = std::clamp(mean[pressure_b], 1e4, 4e6);
  mean[payload] = std::clamp(mean[payload], -0.1, 2.0);  // below zero: an error of a small payload has two sides
  mean[flow_factor] = std::clamp(mean[flow_factor], 0.3, 3.0);
  mean[friction_factor] = std::clamp(mean[friction_factor], 0.1, 5.0);
}

}  // namespace solenoid
