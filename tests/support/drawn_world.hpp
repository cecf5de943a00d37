#pragma once

#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "controllers/systems/actuator/estimators/kalman.hpp"
#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"

#include <memory>
#include <random>

namespace solenoid {

/// A plant drawn from the very distribution an estimator believes in: payload and factors from its prior, forces and
/// pressure drifts as its process noise, pressures through its lag. The thesis's hybrid, told the truth, moves it along
/// the sine. What a filter says of its own errors must hold here.
class DrawnWorld {
 public:
  DrawnWorld(const EstimatorTuning& tuning, std::uint64_t seed)
      : tuning_(tuning),
        random_(seed),
        model_(PneumaticActuator(), tuning.memory),
        lag_(tuning.pressure_filter_hz, actuator_timing.tick_s),
        modes_(valve_modes("three_way", ActuatorParameters())),
        timing_(modes_, actuator_timing.tick_s) {
    VariantConfig variant = new_variant();
    actuator(variant).motor = "pd";
    variant.integral.gain = 0.005;
    const double start_m = ActuatorParameters().equilibrium_position_m();
    controller_ = make_controller(variant, thesis_sine(start_m));
    const double air = ActuatorParameters().atmospheric_pressure_pa;
    x_ = {start_m, 0.0, air, air, tuning.force_sigma_n * draw(), 0.0, 0.0, 0.0};
    x_[payload] = tuning.payload_mean_kg + tuning.payload_sigma_kg * draw();
    x_[flow_factor] = 1.0 + tuning.flow_sigma * draw();
    x_[friction_factor] = 1.0 + tuning.friction_sigma * draw();
    for (auto* z : {&lag_a_, &lag_b_})
      for (std::size_t i = 0; i < z->size(); ++i) (*z)[i] = i % 2 == 0 ? air : 0.0;
  }

  const StateOf<LoadedActuator>& truth() const { return x_; }
  const SwitchedOf<PneumaticActuator>& opening() const { return opening_; }
  double motor_n() const { return motor_n_; }

  Measurement sensors() {
    Measurement s{time_s_, {x_[position], output(lag_a_), output(lag_b_)}, {x_[0], x_[1], x_[2], x_[3]}, true};
    s.value[position_channel] += std::sqrt(tuning_.position_variance()) * draw();
    s.value[pressure_a_channel] += tuning_.pressure_sigma_pa * draw();
    s.value[pressure_b_channel] += tuning_.pressure_sigma_pa * draw();
    return s;
  }

  /// To the next tick, under the command the controller gives for these sensors (and their truth).
  void advance(const Measurement& s) {
    const Command command = controller_->step(s).command;
    lines_.command(command.switches, timing_);
    std::ranges::copy(modes_.point(lines_.effective()), opening_.begin());
    motor_n_ = command.continuous[0];
    lines_.advance(1);
    time_s_ += actuator_timing.tick_s;
    const auto before = x_;
    x_ = model_.step<double>(x_, opening_, {motor_n_}, actuator_timing.tick_s);
    disturb();
    advance(lag_a_, before[pressure_a], x_[pressure_a]);
    advance(lag_b_, before[pressure_b], x_[pressure_b]);
  }

 private:
  using Lag = std::array<double, PressureLag::size>;
  double draw() { return normal_(random_); }
  static double renewal(double memory_s) {
    return std::sqrt(1.0 - std::pow(1.0 - actuator_timing.tick_s / memory_s, 2));
  }

  void disturb() {
    const double root = std::sqrt(actuator_timing.tick_s);
    if (x_[velocity] != 0.0)
      x_[velocity] +=
          actuator_timing.tick_s / ActuatorParameters().equivalent_mass_kg() * tuning_.force_white_n * draw();
    x_[pressure_a] += tuning_.pressure_drift_pa * root * draw();
    x_[pressure_b] += tuning_.pressure_drift_pa * root * draw();
    x_[disturbance] += tuning_.force_sigma_n * renewal(tuning_.memory.force_s) * draw();
    x_[payload] += tuning_.payload_sigma_kg > 0 ? tuning_.payload_drift * root * draw() : 0.0;
    x_[flow_factor] += tuning_.flow_sigma * renewal(tuning_.memory.flow_s) * draw();
    x_[friction_factor] += tuning_.friction_sigma * renewal(tuning_.memory.friction_s) * draw();
  }
  void advance(Lag& z, double before, double after) {
    const double noise = tuning_.pressure_input_sigma_pa * draw();
    const double early = before + noise, late = after + noise;
    lag_.advance<1>(z.data(), &early, &late);
  }
  double output(const Lag& z) const {
    const auto c = lag_.output();
    double sum = 0.0;
    for (std::size_t i = 0; i < z.size(); ++i) sum += c[i] * z[i];
    return sum;
  }

  EstimatorTuning tuning_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  LoadedActuator model_;
  PressureLag lag_;
  ModeSet modes_;
  SwitchTiming timing_;
  std::unique_ptr<Controller> controller_;
  DelayLines lines_{0};
  StateOf<LoadedActuator> x_{};
  Lag lag_a_{}, lag_b_{};
  SwitchedOf<PneumaticActuator> opening_{};
  double motor_n_ = 0.0, time_s_ = 0.0;
};

/// A tuning whose prior keeps the drawn plant physical.
inline EstimatorTuning moderate_tuning() {
  EstimatorTuning tuning;
  tuning.payload_mean_kg = 0.1;
  tuning.payload_sigma_kg = 0.03;
  tuning.flow_sigma = 0.05;
  tuning.friction_sigma = 0.15;
  tuning.position_low_m = tuning.pressure_low_pa = -1e9;  // its sensors have no ends
  tuning.position_high_m = tuning.pressure_high_pa = 1e9;
  return tuning;
}

}  // namespace solenoid
