#pragma once

#include "core/systems/actuator/force_residual.hpp"
#include "core/systems/actuator/prestabilised.hpp"

namespace solenoid {

/// The actuator with a force that its equations leave out and that was identified from logs (force_residual.hpp), and with
/// the motor's PD law in the prediction, which gains of zero take out of it:
///
///     m_eq dv/dt = ... + d + g(y, v)
///
/// A type of its own: models without such a force are what they were, to the last bit and as fast. The estimator's model
/// has the same g (LoadedActuator), so the disturbance d that is handed to a prediction is of what g leaves.
class ResidualActuator : public PrestabilisedActuator {
 public:
  explicit ResidualActuator(const ActuatorParameters& parameters = {}, const MotorGains& gains = {},
                            const ForceResidual& residual = {})
      : PrestabilisedActuator(parameters, gains), residual_(residual) {}

  template <class S>
  Vector<S, 4> step(const Vector<S, 4>& x, const Vector<S, 4>& opening, const Vector<S, 1>& motor, double dt) const {
    const auto held = conditions<double>(load()[0], load()[1], 1.0);
    const Conditions<S> now = {S(held.inverse_mass),
                               S(held.gravity_amplitude),
                               S(S(held.external_force) + residual_.force<S>(x[position], x[velocity])),
                               S(held.stiction),
                               S(held.coulomb),
                               S(held.viscous)};
    return step_under<S>(x, opening, motor, dt, now);
  }

  /// PneumaticActuator::smooth_step() with the same force; end stops do not hold what it adds to the velocity of the step
  /// that reaches them.
  template <class S>
  Vector<S, 4> smooth_step(const Vector<S, 4>& x, const Vector<S, 4>& opening, const Vector<S, 1>& motor,
                           double dt) const {
    const auto held = conditions<double>(load()[0], load()[1], 1.0);
    Vector<S, 4> next = PneumaticActuator::smooth_step<S>(x, opening, motor, dt);
    next[velocity] = next[velocity] + S(dt * held.inverse_mass) * residual_.force<S>(x[position], x[velocity]);
    return next;
  }

  /// Encloses a step as the base does, with the least and the greatest residual of the box beside the motor's force.
  template <class S>
  void enclose_step(Vector<S, 4>& low, Vector<S, 4>& high, const Vector<S, 4>& opening_low,
                    const Vector<S, 4>& opening_high, const Vector<double, 2>& setpoint,
                    const Vector<double, 1>& planned, double dt) const {
    const Vector<S, 2> g = residual_.range<S>(low[position], high[position], low[velocity], high[velocity]);
    const S at_low = gains().template force<S>(high[position], low[velocity], setpoint) + S(planned[0]);
    const S at_high = gains().template force<S>(low[position], high[velocity], setpoint) + S(planned[0]);
    PneumaticActuator::enclose_step<S>(low, high, opening_low, opening_high, S(saturated_motor_force<S>(at_low) + g[0]),
                                       S(saturated_motor_force<S>(at_high) + g[1]), dt);
  }

  const ForceResidual& residual() const { return residual_; }

 private:
  ForceResidual residual_;
};

}  // namespace solenoid
