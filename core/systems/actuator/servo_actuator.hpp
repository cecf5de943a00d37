#pragma once

#include "core/systems/actuator/prestabilised.hpp"
#include "core/systems/actuator/servo_valve.hpp"

namespace solenoid {

/// Indices into the servo actuator's state beyond the actuator's own.
enum ServoStateIndex : std::size_t { opening_a = 4, opening_a_rate = 5, opening_b = 6, opening_b_rate = 7 };
/// Indices into its continuous inputs, and into those of a Command.
enum ServoInputIndex : std::size_t { motor_input = 0, opening_a_input = 1, opening_b_input = 2 };

/// The actuator on servo valves, as controllers predict it (model.md, section 5).
///
/// state       x = (y, v, Pa, Pb of PneumaticActuator, o_a, o_a' [1/s], o_b, o_b'): signed openings, supply by o > 0
/// switched    openings of on/off valves beside them, as PneumaticActuator: shut in the mode set `servo`
/// continuous  u = (motor force [N], wanted openings of A and of B in [-1, 1])
/// output      z = (y, v)
///
///     o'' + 2 zeta w o' + w^2 o = w^2 u           exactly, at constant u over a step
///     s_fill = max(o, 0), s_exhaust = max(-o, 0),  at the mean of o at the step's begin and end
///
/// Overlap and hysteresis are not in it: the command that is sent makes up for the overlap (ServoInputs), so the wanted
/// opening has a derivative everywhere. What a leak at null does is the disturbance's and the flow factor's to find.
class ServoActuator : public PneumaticActuator {
 public:
  static constexpr std::size_t state_size = 8, switched_size = 4, continuous_size = 3, output_size = 2;

  /// For steps of tick_s; other steps are right too, and slower.
  explicit ServoActuator(const ActuatorParameters& parameters = {}, double tick_s = 1e-3)
      : PneumaticActuator(parameters), tick_s_(tick_s), spool_(parameters.servo, tick_s) {}

  template <class S>
  Vector<S, 8> step(const Vector<S, 8>& x, const Vector<S, 4>& shut, const Vector<S, 3>& u, double dt) const {
    using std::max;
    const auto positive = [](const S& o) { return S(max(o, S(0.0))); };
    return stepped<S>(x, shut, u, dt, positive,
                      [this, dt](const auto&... parts) { return PneumaticActuator::step<S>(parts..., dt); });
  }

  /// PneumaticActuator::smooth_step() with max(o, 0) as (o + sqrt(o^2 + e^2))/2, e = null_roundness: off by at most e/2
  /// in an opening, at null.
  template <class S>
  Vector<S, 8> smooth_step(const Vector<S, 8>& x, const Vector<S, 4>& shut, const Vector<S, 3>& u, double dt) const {
    using std::sqrt;
    const auto positive = [](const S& o) {
      return S(S(0.5) * (o + S(sqrt(S(o * o + S(null_roundness * null_roundness))))));
    };
    return stepped<S>(x, shut, u, dt, positive,
                      [this, dt](const auto&... parts) { return PneumaticActuator::smooth_step<S>(parts..., dt); });
  }
  static constexpr double null_roundness = 0.004;

  template <class S>
  Vector<S, 2> output(const Vector<S, 8>& x) const {
    return {x[position], x[velocity]};
  }

  /// Supply air drawn at the openings of the step's begin [kg/s].
  template <class S>
  S consumption(const Vector<S, 8>& x, const Vector<S, 4>& shut) const {
    using std::max;
    return scaled_fill_flow<S>(S(shut[fill_a] + S(max(x[opening_a], S(0.0)))), x[pressure_a]) +
           scaled_fill_flow<S>(S(shut[fill_b] + S(max(x[opening_b], S(0.0)))), x[pressure_b]);
  }

  /// A rate is 2 pi f times an opening.
  Vector<double, 8> state_scale() const { return {1e-3, 1e-1, 1e5, 1e5, 0.1, 30.0, 0.1, 30.0}; }

  Vector<double, 8> nearest_valid(const Vector<double, 8>& x) const {
    const auto own = PneumaticActuator::nearest_valid({x[position], x[velocity], x[pressure_a], x[pressure_b]});
    return {own[0], own[1], own[2], own[3], x[opening_a], x[opening_a_rate], x[opening_b], x[opening_b_rate]};
  }

 private:
  template <class S, class Positive, class Slide>
  Vector<S, 8> stepped(const Vector<S, 8>& x, const Vector<S, 4>& shut, const Vector<S, 3>& u, double dt,
                       const Positive& positive, const Slide& slide) const {
    const SpoolStep spool = dt == tick_s_ ? spool_ : SpoolStep(parameters().servo, dt);
    Vector<S, 4> opening = shut;
    Vector<S, 8> next;
    for (std::size_t i = 0; i < 2; ++i) {
      const S& o = x[opening_a + 2 * i];
      const S& rate = x[opening_a_rate + 2 * i];
      const S& wanted = u[opening_a_input + i];
      const S apart = o - wanted;
      next[opening_a + 2 * i] = wanted + S(spool.xx) * apart + S(spool.xv) * rate;
      next[opening_a_rate + 2 * i] = S(spool.vx) * apart + S(spool.vv) * rate;
      const S mean = S(0.5) * (o + next[opening_a + 2 * i]);
      opening[fill_a + 2 * i] = opening[fill_a + 2 * i] + positive(mean);
      opening[exhaust_a + 2 * i] = opening[exhaust_a + 2 * i] + positive(S(-mean));
    }
    const auto own = slide(Vector<S, 4>{x[position], x[velocity], x[pressure_a], x[pressure_b]}, opening,
                           Vector<S, 1>{u[motor_input]});
    for (std::size_t i = 0; i < 4; ++i) next[i] = own[i];
    return next;
  }

  double tick_s_;
  SpoolStep spool_;
};

/// The same with the motor's PD law (5.14) in its prediction, as PrestabilisedActuator has it.
class PrestabilisedServo : public ServoActuator {
 public:
  explicit PrestabilisedServo(const ActuatorParameters& parameters = {}, const MotorGains& gains = {},
                              double tick_s = 1e-3)
      : ServoActuator(parameters, tick_s), gains_(gains) {}

  template <class S>
  Vector<S, 3> feedback(const Vector<S, 8>& x, const Vector<double, 2>& setpoint) const {
    return {gains_.force<S>(x[position], x[velocity], setpoint), S(0.0), S(0.0)};
  }

  const MotorGains& gains() const { return gains_; }

 private:
  MotorGains gains_;
};

}  // namespace solenoid
