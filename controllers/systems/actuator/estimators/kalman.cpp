#include "controllers/systems/actuator/estimators/kalman.hpp"

#include "core/systems/actuator/signals.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace solenoid {

ActuatorKalman::ActuatorKalman(const PneumaticActuator& model, const EstimatorTuning& tuning) : model_(model, tuning) {}

ActuatorState ActuatorKalman::update(const Measurement& sensors) noexcept {
  const bool sound = belief_.mean.allFinite() && belief_.covariance.allFinite();
  const bool all = std::isfinite(sensors.value[position_channel] + sensors.value[pressure_a_channel] +
                                 sensors.value[pressure_b_channel]);
  const double age_ticks = sensors.age_s / model_.tuning().tick_s;
  if (starts_ > 0 && sound && lost_ticks_ < patience_ticks) {
    const bool any =
        std::any_of(sensors.value.begin(), sensors.value.begin() + 3, [](double v) { return std::isfinite(v); });
    late_.passed(inputs_);
    for (const int back = late_.aim(age_ticks, any); late_.behind() > back;) predict();
    innovation_ = correct(sensors);
  } else if (const int back = late_.whole_ticks(age_ticks); all && back < late_.most_ticks) {
    late_.remember(inputs_);
    model_.start(sensors, starts_ == 0, belief_);
    ++starts_;
    lost_ticks_ = 0;
    change_ = {};
    late_.start(back);
  } else {
    late_.remember(inputs_);
  }
  now_ = belief_;
  for (int ticks = late_.behind(); ticks > 0; --ticks) {
    const Inputs& in = late_.inputs(ticks);
    model_.advance(now_.mean, now_.at_rest, in.opening, in.motor_n);
  }
  return actuator_state(now_);
}

void ActuatorKalman::applied(const SwitchedOf<PneumaticActuator>& opening, double motor_n) noexcept {
  inputs_ = {opening, motor_n};
}

void ActuatorKalman::predict() noexcept {
  const Inputs& in = late_.inputs(late_.behind());
  late_.caught_up();
  for (const int i : {0, 1, 2}) change_[static_cast<std::size_t>(i)] = -model_.sensor(i).dot(belief_.mean);
  SensedModel::Jacobian jacobian;
  double unknown_variance = 0.0;
  const double velocity_sigma = std::sqrt(std::max(0.0, belief_.covariance(velocity, velocity)));
  model_.linearise(belief_.mean, velocity_sigma, in.opening, in.motor_n, jacobian, unknown_variance);
  model_.advance(belief_.mean, belief_.at_rest, in.opening, in.motor_n);
  for (const int i : {0, 1, 2}) change_[static_cast<std::size_t>(i)] += model_.sensor(i).dot(belief_.mean);
  // P is symmetric, so F P F' = F (F P)'.
  model_.propagate<Belief::size>(jacobian, belief_.covariance.data());
  belief_.covariance.transposeInPlace();
  model_.propagate<Belief::size>(jacobian, belief_.covariance.data());
  model_.add_process_noise(unknown_variance, belief_.covariance);
}

double ActuatorKalman::correct(const Measurement& sensors) noexcept {
  Belief::Covariance& p = belief_.covariance;
  const ChannelValues& measured = sensors.value;
  double squares = 0.0;
  innovations_ = {};
  for (const int i : {0, 1, 2}) {
    if (!late_.taken() || !std::isfinite(measured[i])) continue;
    const Belief::State& h = model_.sensor(i);
    const Belief::State ph = p * h;
    double expected = h.dot(belief_.mean);
    if (late_.rest() != 0.0) expected -= late_.rest() * change_[static_cast<std::size_t>(i)];
    const double spread = h.dot(ph);
    if (model_.saturated(i, measured[i], expected)) continue;
    const double innovation = measured[i] - expected;
    const double believed = spread + model_.sensor_variance(i);
    const double gate = model_.tuning().gate_sigmas;
    const double variance = std::max(believed, innovation * innovation / (gate * gate));
    const Belief::State gain = ph / variance;
    belief_.mean += gain * innovation;
    // (I - K h') P (I - K h')' + K r K', factor by factor: symmetric and positive whatever the rounding of K.
    p.noalias() -= gain * ph.transpose();
    const Belief::State left = p * h;
    p.noalias() -= left * gain.transpose();
    p.noalias() += (variance - spread) * gain * gain.transpose();
    innovations_[static_cast<std::size_t>(i)] = innovation * innovation / believed;
    squares += innovation * innovation / believed;
    if (i == 0) lost_ticks_ = innovation * innovation > lost_sigmas * lost_sigmas * believed ? lost_ticks_ + 1 : 0;
  }
  p = (0.5 * (p + p.transpose())).eval();
  model_.confine(belief_.mean);
  return squares;
}

EstimateDetail ActuatorKalman::detail() const noexcept { return estimate_detail(now_, innovation_); }

ActuatorState actuator_state(const Belief& b) noexcept {
  return {b.mean[position], b.mean[velocity], b.mean[pressure_a], b.mean[pressure_b]};
}

EstimateDetail estimate_detail(const Belief& b, double innovation) noexcept {
  const auto sigma = [&b](auto i) {
    const int k = static_cast<int>(i);
    return std::sqrt(std::max(0.0, b.covariance(k, k)));
  };
  EstimateDetail d;
  d.belief[payload_belief] = b.mean[payload], d.belief[payload_sigma_belief] = sigma(payload);
  d.belief[disturbance_belief] = b.mean[disturbance], d.belief[disturbance_sigma_belief] = sigma(disturbance);
  d.belief[flow_factor_belief] = b.mean[flow_factor], d.belief[friction_factor_belief] = b.mean[friction_factor];
  d.sigma = {sigma(position), sigma(velocity), sigma(pressure_a), sigma(pressure_b)};
  d.innovation = innovation;
  return d;
}

}  // namespace solenoid
