#include "controllers/systems/actuator/estimators/moving_horizon.hpp"

#include <cmath>

#include <Eigen/Cholesky>

namespace solenoid {
namespace {

/// Residuals beyond this many standard deviations count linearly.
constexpr double huber_sigmas = 3.0;
/// Noise before the Bessel filter is correlated over its delay: so many samples say as much as one.
constexpr double correlated_ticks = 10.0;
/// Root mean square of the filter's output over that of white noise at its input, at 1 kHz.
constexpr double filter_noise_gain = 0.32;

double huber(double r) {
  const double a = std::abs(r);
  return a <= huber_sigmas ? r * r : huber_sigmas * (2 * a - huber_sigmas);
}
double huber_weight(double r) { return std::abs(r) <= huber_sigmas ? 1.0 : huber_sigmas / std::abs(r); }

double measured(const Measurement& s, int sensor) { return s.value[static_cast<std::size_t>(sensor)]; }

}  // namespace

MovingHorizon::MovingHorizon(const PneumaticActuator& model, const EstimatorTuning& t)
    : kalman_(model, t),
      ring_(static_cast<std::size_t>(t.window_ticks) + 1),
      position_sigma_m_(std::sqrt(t.position_variance())) {
  const double before = filter_noise_gain * t.pressure_input_sigma_pa;
  pressure_sigma_pa_ = std::hypot(t.pressure_sigma_pa, std::sqrt(correlated_ticks) * before);
}

void MovingHorizon::applied(const SwitchedOf<PneumaticActuator>& opening, double motor_n) noexcept {
  kalman_.applied(opening, motor_n);
  if (newest_ < 0) return;
  Tick& now = ring_[static_cast<std::size_t>(newest_)];
  now.opening = opening;
  now.motor_n = motor_n;
}

ActuatorState MovingHorizon::update(const Measurement& sensors) noexcept {
  kalman_.update(sensors);
  remember(sensors);
  belief_ = kalman_.belief();
  if (filled_ > 1) estimate();
  return actuator_state(belief_);
}

void MovingHorizon::remember(const Measurement& sensors) noexcept {
  if (kalman_.starts() != starts_) filled_ = 0;  // nothing before a new start is of use
  starts_ = kalman_.starts();
  const int capacity = static_cast<int>(ring_.size());
  newest_ = (newest_ + 1) % capacity;
  filled_ = std::min(filled_ + 1, capacity);
  Tick& now = ring_[static_cast<std::size_t>(newest_)];
  now.sensors = sensors;
  now.belief = kalman_.belief();
}

const MovingHorizon::Tick& MovingHorizon::tick(int age) const noexcept {
  const int capacity = static_cast<int>(ring_.size());
  return ring_[static_cast<std::size_t>((newest_ - age + capacity) % capacity)];
}

/// Gauss-Newton over the window; a step that does not descend is halved, and given up after three halvings.
void MovingHorizon::estimate() noexcept {
  span_ = filled_ - 1;
  block_ticks_ = (span_ + blocks - 1) / blocks;
  const EstimatorTuning& tuning = kalman_.model().tuning();
  const double block_s = block_ticks_ * tuning.tick_s;
  force_step_n_ = tuning.force_sigma_n * std::sqrt(-std::expm1(-2 * block_s / tuning.memory.force_s));
  pressure_step_pa_ = tuning.pressure_drift_pa * std::sqrt(block_s) / block_ticks_;
  arrival_ = tick(span_).belief.mean;
  const Eigen::LLT<Belief::Covariance> arrival(tick(span_).belief.covariance);
  if (arrival.info() != Eigen::Success) return;  // the Kalman filter's estimate stands
  root_ = arrival.matrixL();

  Unknowns z = Unknowns::Zero();
  Belief::State end, best;
  Eigen::LLT<Normal> factor;
  cost_ = cost_at_arrival_ = roll(z, best);
  for (int i = 0; i < tuning.iterations; ++i) {
    linearise(z);
    factor.compute(normal_);
    if (factor.info() != Eigen::Success) return;
    Unknowns step = -factor.solve(gradient_);
    Unknowns trial = z + step;
    double cost = roll(trial, end);
    for (int halvings = 0; !(cost <= cost_) && halvings < 3; ++halvings) {
      step *= 0.5;
      trial = z + step;
      cost = roll(trial, end);
    }
    if (!(cost <= cost_)) break;
    z = trial;
    cost_ = cost;
    best = end;
  }
  if (!std::isfinite(cost_) || !best.allFinite()) return;
  belief_.mean = best;
  kalman_.model().confine(belief_.mean);
  // The covariance at the end, S (I + J'J)^-1 S', by the last linearisation.
  const Eigen::Matrix<double, unknowns, Belief::size> half = factor.matrixL().solve(sensitivity_.transpose());
  belief_.covariance.noalias() = half.transpose() * half;
}

void MovingHorizon::disturb(int k, const Unknowns& z, Belief::State& x) const noexcept {
  const int first = Belief::size + kinds * (k / block_ticks_);
  if (k % block_ticks_ == 0) x[disturbance] += force_step_n_ * z[first];
  x[pressure_a] += pressure_step_pa_ * z[first + 1];
  x[pressure_b] += pressure_step_pa_ * z[first + 2];
}

void MovingHorizon::disturb(int k, Sensitivity& s) const noexcept {
  const int first = Belief::size + kinds * (k / block_ticks_);
  if (k % block_ticks_ == 0) s(disturbance, first) += force_step_n_;
  s(pressure_a, first + 1) += pressure_step_pa_;
  s(pressure_b, first + 2) += pressure_step_pa_;
}

bool MovingHorizon::informative(int sensor, double value, double expected) const noexcept {
  return std::isfinite(value) && !kalman_.model().saturated(sensor, value, expected);
}

double MovingHorizon::measurement_cost(const Tick& at, const Belief::State& x) const noexcept {
  double cost = 0.0;
  for (const int i : {0, 1, 2}) {
    const double expected = kalman_.model().expected(i, x), value = measured(at.sensors, i);
    if (informative(i, value, expected)) cost += huber((value - expected) / sigma(i));
  }
  return cost;
}

double MovingHorizon::roll(const Unknowns& z, Belief::State& x) const noexcept {
  x = arrival_;
  x.noalias() += root_.triangularView<Eigen::Lower>() * z.head<Belief::size>();
  bool at_rest = tick(span_).belief.at_rest;
  double cost = z.squaredNorm();
  for (int k = 0; k < span_; ++k) {
    disturb(k, z, x);
    kalman_.model().advance(x, at_rest, tick(span_ - k).opening, tick(span_ - k).motor_n);
    cost += measurement_cost(tick(span_ - k - 1), x);
  }
  return cost;
}

void MovingHorizon::linearise(const Unknowns& z) noexcept {
  const SensedModel& model = kalman_.model();
  const double velocity_sigma = std::sqrt(tick(span_).belief.covariance(velocity, velocity));
  Belief::State x = arrival_;
  x.noalias() += root_.triangularView<Eigen::Lower>() * z.head<Belief::size>();
  sensitivity_.setZero();
  sensitivity_.leftCols<Belief::size>() = root_;
  normal_.setIdentity();
  gradient_ = z;
  SensedModel::Jacobian jacobian;
  double unknown_variance = 0.0;
  bool at_rest = tick(span_).belief.at_rest;
  for (int k = 0; k < span_; ++k) {
    const Tick& from = tick(span_ - k);
    disturb(k, z, x);
    disturb(k, sensitivity_);
    model.linearise(x, velocity_sigma, from.opening, from.motor_n, jacobian, unknown_variance);
    model.advance(x, at_rest, from.opening, from.motor_n);
    model.propagate<unknowns>(jacobian, sensitivity_.data());
    weigh(tick(span_ - k - 1), x);
  }
}

/// Adds a tick's measurements to gradient and Gauss-Newton matrix, Huber's weights as in reweighted least squares.
void MovingHorizon::weigh(const Tick& at, const Belief::State& x) noexcept {
  for (const int i : {0, 1, 2}) {
    const double expected = kalman_.model().expected(i, x), value = measured(at.sensors, i);
    if (!informative(i, value, expected)) continue;
    const double residual = (value - expected) / sigma(i), weight = huber_weight(residual);
    Unknowns row;
    kalman_.model().sensor_row<unknowns>(i, sensitivity_.data(), row.data());
    row /= sigma(i);
    gradient_.noalias() -= weight * residual * row;
    for (int c = 0; c < unknowns; ++c)  // the lower triangle is all that the factorisation reads
      normal_.col(c).tail(unknowns - c).noalias() += (weight * row[c]) * row.tail(unknowns - c);
  }
}

}  // namespace solenoid
