#pragma once

#include "controllers/estimators/late_values.hpp"
#include "controllers/systems/actuator/estimators/sensed_model.hpp"

namespace solenoid {

/// Extended Kalman filter through the sensing chain (`ekf`, `payload_ekf`).                [estimators.md, section 2]
///
///     each tick   x, P through the model with the inputs in effect since the last (applied), then the three sensors
///                 one after the other, each a scalar update in Joseph's form; values that were measured before the
///                 tick are taken where they belong, and the mean is predicted from there (late_values.hpp)
///
/// shapes      24 states, 3 measurements
/// promise     no allocation, lock or exception
class ActuatorKalman {
 public:
  ActuatorKalman(const PneumaticActuator& model, const EstimatorTuning& tuning);

  /// Takes the sensors of this tick; returns the estimate at this tick. Non-finite sensors are left out; a non-finite
  /// belief, or one that positions contradict for long, starts anew, at the tick that its sensors are of.
  ActuatorState update(const Measurement& sensors) noexcept;
  /// Inputs in effect from this tick to the next.
  void applied(const SwitchedOf<PneumaticActuator>& opening, double motor_n) noexcept;

  EstimateDetail detail() const noexcept;
  /// Mean of the present; covariance of the tick that the newest values were of.
  const Belief& belief() const { return now_; }
  double innovation() const { return innovation_; }
  /// The last tick's innovations squared, in their variances: position, pressures; 0 for a sensor left out.
  const std::array<double, 3>& innovations() const { return innovations_; }
  std::int64_t starts() const { return starts_; }
  const SensedModel& model() const { return model_; }

 private:
  /// What acts during a tick.
  struct Inputs {
    SwitchedOf<PneumaticActuator> opening{};
    double motor_n = 0.0;
  };
  void predict() noexcept;
  /// Returns the normalised innovation squared.
  double correct(const Measurement& sensors) noexcept;

  /// So many ticks in a row with positions so far off: the belief is wrong beyond repair.
  static constexpr int patience_ticks = 10;
  static constexpr double lost_sigmas = 15.0;

  SensedModel model_;
  Belief belief_, now_;
  Inputs inputs_;
  double innovation_ = 0.0;
  std::array<double, 3> innovations_{};
  std::array<double, 3> change_{};  // of the sensors in the last tick, as predicted
  LateValues<Inputs> late_;
  int lost_ticks_ = 0;
  std::int64_t starts_ = 0;
};

/// The part of a belief that controllers and logs read.
ActuatorState actuator_state(const Belief& belief) noexcept;
/// What the belief says beyond the state, with the tick's normalised innovation squared.
EstimateDetail estimate_detail(const Belief& belief, double innovation) noexcept;

}  // namespace solenoid
