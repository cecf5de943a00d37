#pragma once

#include "controllers/systems/actuator/motor_inputs.hpp"
#include "core/systems/actuator/servo_actuator.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {

/// How wanted openings become a servo valve's commands.
struct ServoSettings {
  double effort = 3e-9;        ///< weight of the squared openings, at each step
  double compensation = 0.04;  ///< overlap that the command jumps over
  double transition = 0.01;    ///< wanted opening by which it has jumped over 0.7 of it
  bool operator==(const ServoSettings&) const = default;
};

/// The Inputs of an MpcController over a ServoActuator: the motor's force as MotorInputs has it, and the openings that
/// the plan wants, which are commanded with the overlap made up for,
///
///     c = o (1 - d) + d o / sqrt(o^2 + e^2)
///
/// the inverse of the valve's overlap d, rounded off over e so that noise at null does not throw the spool across it. A d
/// below the valve's own leaves a rest of the overlap, one above it hunts.
class ServoInputs {
 public:
  /// Where the plan has no share of the motor's force, what rounding leaves of one is none.
  ServoInputs(const MotorInputs& motor, const ServoSettings& settings, bool plans_motor)
      : motor_(motor), overlap_(settings.compensation), transition_(settings.transition), plans_motor_(plans_motor) {}

  void believe(const EstimateDetail& found, PneumaticActuator& model) noexcept { motor_.believe(found, model); }

  template <HybridModel Model>
  Vector<double, 3> apply(const Model& model, const ReferenceSample& desired, const StateOf<Model>& x,
                          const Vector<double, 3>& planned) const noexcept {
    const double force = motor_.force(model, desired, {x[position], x[velocity], x[pressure_a], x[pressure_b]},
                                      plans_motor_ ? planned[motor_input] : 0.0);
    return {force, planned[opening_a_input], planned[opening_b_input]};
  }

  /// What is commanded for the model's inputs.
  Vector<double, 3> commanded(const Vector<double, 3>& u) const noexcept {
    return {u[motor_input], command_for(u[opening_a_input]), command_for(u[opening_b_input])};
  }
  /// Of one valve.
  double command_for(double opening) const noexcept {
    const double o = std::clamp(opening, -1.0, 1.0);
    const double length = std::sqrt(o * o + transition_ * transition_);
    return o * (1.0 - overlap_) + (length > 0.0 ? overlap_ * o / length : 0.0);
  }

 private:
  MotorInputs motor_;
  double overlap_, transition_;
  bool plans_motor_;
};

}  // namespace solenoid
