#pragma once

#include "core/systems/actuator/dynamics.hpp"

namespace solenoid {

/// A motor's position law has these gains; the defaults are the thesis's (7.2).
struct MotorGains {
  double proportional = 23000.0;  ///< K_pe [N/m]
  double derivative = 400.0;      ///< K_de [N s/m]
  /// The law before the amplifier's limit (5.14) [N], at a desired position and velocity.
  template <class S>
  S force(const S& y, const S& v, const Vector<double, 2>& setpoint) const {
    return S(proportional) * (S(setpoint[0]) - y) + S(derivative) * (S(setpoint[1]) - v);
  }
  bool operator==(const MotorGains&) const = default;
};

/// This actuator has the motor's PD law (5.14) in its prediction, so that the search knows what the motor will do:
///
///     F_m = sat(K_pe (y_set - y) + K_de (v_set - v) + planned)
class PrestabilisedActuator : public PneumaticActuator {
 public:
  explicit PrestabilisedActuator(const ActuatorParameters& parameters = {}, const MotorGains& gains = {})
      : PneumaticActuator(parameters), gains_(gains) {}

  template <class S>
  Vector<S, 1> feedback(const Vector<S, 4>& x, const Vector<double, 2>& setpoint) const {
    return {gains_.force<S>(x[position], x[velocity], setpoint)};
  }

  /// Encloses a step as the base does; the law falls with position and velocity, so its extremes over the box are at
  /// opposite corners.
  template <class S>
  void enclose_step(Vector<S, 4>& low, Vector<S, 4>& high, const Vector<S, 4>& opening_low,
                    const Vector<S, 4>& opening_high, const Vector<double, 2>& setpoint,
                    const Vector<double, 1>& planned, double dt) const {
    // v_next rises with v while K_de dt < m_eq: the law may take each bound's own velocity.
    const S at_low = gains_.force<S>(high[position], low[velocity], setpoint) + S(planned[0]);
    const S at_high = gains_.force<S>(low[position], high[velocity], setpoint) + S(planned[0]);
    PneumaticActuator::enclose_step<S>(low, high, opening_low, opening_high, saturated_motor_force<S>(at_low),
                                       saturated_motor_force<S>(at_high), dt);
  }

  const MotorGains& gains() const { return gains_; }

 private:
  MotorGains gains_;
};

}  // namespace solenoid
