#pragma once

#include "core/actuator/parameters.hpp"
#include "core/mpc/hybrid_model.hpp"

#include <cmath>

namespace solenoid {

/// Indices into the actuator's vectors.
enum StateIndex : std::size_t { position = 0, velocity = 1, pressure_a = 2, pressure_b = 3 };
enum OpeningIndex : std::size_t { fill_a = 0, exhaust_a = 1, fill_b = 2, exhaust_b = 3 };

/// The hybrid pneumatic-electric actuator: one piece of physics for controllers, solvers, estimators and plants.
///
/// state       x = (y [m], v [m/s], Pa, Pb [Pa absolute])
/// switched    s = valve openings (fill A, exhaust A, fill B, exhaust B), each in [0, 1]; the flow is affine in them
/// continuous  u = motor force [N], saturated at the amplifier's limit
/// output      z = (y [m], v [m/s])
///
///     V_a dPa/dt =  k R T mdot_a - k Pa A_a v,   V_a = (y_a0 + y) A_a                            (4.18, 4.19, 4.21)
///     V_b dPb/dt =  k R T mdot_b + k Pb A_b v,   V_b = (y_b0 - y) A_b                            (4.20, 4.22 as
///     corrected) mdot       =  s_fill fill(P) + s_exhaust exhaust(P) (5.7, 5.8) m_eq dv/dt =  Pa A_a - Pb A_b - P_0
///     (A_a - A_b) + F_grav(y) + F_m - F_fric                  (4.1-4.14)
///
/// step() is the explicit Euler method of the thesis (5.4) with three non-smooth corrections: a slide at rest stays
/// while |applied force| <= F_sf; a velocity that would change its sign stops at zero; end stops are inelastic.
class PneumaticActuator {
 public:
  static constexpr std::size_t state_size = 4, switched_size = 4, continuous_size = 1, output_size = 2;

  explicit PneumaticActuator(const ActuatorParameters& parameters = {});

  const ActuatorParameters& parameters() const { return parameters_; }

  /// Flow into a chamber through its fully open supply valve [kg/s], (5.8); none where (5.8) has no real value, at
  /// chamber pressures above supply.
  template <class S>
  S fill_flow(const S& pressure) const {
    using std::sqrt;
    const S head = S(supply_) - pressure;
    const S root = sqrt(select(head < S(0.0), S(0.0), head));
    return select(pressure < S(fill_choked_below_), S(choked_flow_), S(fill_coefficient_) * root);
  }

  /// Flow into a chamber through its fully open exhaust valve [kg/s], negative above atmosphere, (5.7).
  template <class S>
  S exhaust_flow(const S& pressure) const {
    return select(pressure > S(exhaust_choked_above_), S(-choked_flow_),
                  S(discharge_coefficient_) * (S(atmosphere_) - pressure));
  }

  /// Gravity on the slide [N], (4.8).
  template <class S>
  S gravity_force(const S& y) const {
    return S(block_weight_) - S(gravity_amplitude_) * sine_of_arm_angle(y);
  }

  /// Pressure force of the cylinder [N], (4.3) with E9.
  template <class S>
  S cylinder_force(const S& pa, const S& pb) const {
    return S(area_a_) * pa - S(area_b_) * pb - S(atmosphere_force_);
  }

  /// Fill flow from a supply at another pressure; its choked flow grows with it, as an orifice's does.
  template <class S>
  S fill_flow(const S& pressure, const S& supply) const {
    using std::sqrt;
    const S head = supply - pressure;
    const S root = sqrt(select(head < S(0.0), S(0.0), head));
    return select(pressure < S(critical_ratio_) * supply, S(choked_per_supply_) * supply, S(fill_coefficient_) * root);
  }

  /// Friction of a slide moving in `direction` (+1 or -1) [N], second line of (4.14).
  template <class S>
  S sliding_friction(const S& v, const S& direction) const {
    return S(coulomb_) * direction + S(viscous_) * v;
  }

  /// Lengths of the air columns [m]; times the piston areas, the volumes (4.19), (4.20).
  template <class S>
  S column_a(const S& y) const {
    return S(dead_length_a_) + y;
  }
  template <class S>
  S column_b(const S& y) const {
    return S(dead_length_b_) - y;
  }

  template <class S>
  S saturated_motor_force(const S& force) const {
    const S below = select(force < S(-motor_limit_), S(-motor_limit_), force);
    return select(below > S(motor_limit_), S(motor_limit_), below);
  }

  /// Velocity after dt under the applied force (everything but friction), (4.2) with the friction law (4.14).
  template <class S>
  S velocity_after(const S& v, const S& applied, double dt) const {
    const auto moving = v != S(0.0);
    const S direction = select(select(moving, v, applied) < S(0.0), S(-1.0), S(1.0));
    const S friction = S(coulomb_) * direction + S(viscous_) * v;
    const S next = v + S(dt * inverse_mass_) * (applied - friction);
    const S slid = select(v * next < S(0.0), S(0.0), next);
    const S magnitude = select(applied < S(0.0), -applied, applied);
    return select(select(moving, S(static_), magnitude) > S(static_), slid, select(moving, slid, S(0.0)));
  }

  template <class S>
  Vector<S, 4> step(const Vector<S, 4>& x, const Vector<S, 4>& opening, const Vector<S, 1>& motor, double dt) const {
    const auto& [y, v, pa, pb] = x;
    const S flow_a = opening[fill_a] * fill_flow<S>(pa) + opening[exhaust_a] * exhaust_flow<S>(pa);
    const S flow_b = opening[fill_b] * fill_flow<S>(pb) + opening[exhaust_b] * exhaust_flow<S>(pb);
    const S length_a = S(dead_length_a_) + y, length_b = S(dead_length_b_) - y;
    const S per_lengths = S(dt) / (length_a * length_b);  // one division for both chambers
    const S pa_next = pa + (S(heating_a_) * flow_a - S(ratio_) * (pa * v)) * (length_b * per_lengths);
    const S pb_next = pb + (S(heating_b_) * flow_b + S(ratio_) * (pb * v)) * (length_a * per_lengths);

    const S applied = cylinder_force<S>(pa, pb) + gravity_force<S>(y) + saturated_motor_force<S>(motor[0]);
    const S v_free = velocity_after<S>(v, applied, dt);
    const S y_free = y + S(dt) * v;
    const auto low = y_free<S(position_min_), high = y_free> S(position_max_);
    const S y_next = select(low, S(position_min_), select(high, S(position_max_), y_free));
    const S v_next = select(low & (v_free < S(0.0)), S(0.0), select(high & (v_free > S(0.0)), S(0.0), v_free));
    return {y_next, v_next, select(pa_next < S(0.0), S(0.0), pa_next), select(pb_next < S(0.0), S(0.0), pb_next)};
  }

  template <class S>
  Vector<S, 2> output(const Vector<S, 4>& x) const {
    return {x[position], x[velocity]};
  }

  /// Supply air drawn [kg/s].
  template <class S>
  S consumption(const Vector<S, 4>& x, const Vector<S, 4>& opening) const {
    return opening[fill_a] * fill_flow<S>(x[pressure_a]) + opening[fill_b] * fill_flow<S>(x[pressure_b]);
  }

  /// The nearest state inside the end stops with pressures between vacuum and twice supply: what a prediction starts
  /// from when a measurement is noisy.
  Vector<double, 4> nearest_valid(const Vector<double, 4>& x) const;

 private:
  /// sin(2 y/d_pitch) for the arm's angles over the stroke, by the even Taylor polynomial of cos about a horizontal
  /// arm: below 3e-14 for |angle - pi/2| <= 1.75. A polynomial, so that double, SIMD and dual numbers round alike.
  template <class S>
  S sine_of_arm_angle(const S& y) const {
    const S phi = S(angle_per_m_) * y - S(std::numbers::pi / 2);
    const S z = phi * phi, z2 = z * z, z4 = z2 * z2;
    const S c01 = S(1.0) - S(1.0 / 2) * z;
    const S c23 = S(1.0 / 24) - S(1.0 / 720) * z;
    const S c45 = S(1.0 / 40320) - S(1.0 / 3628800) * z;
    const S c67 = S(1.0 / 479001600) - S(1.0 / 87178291200.0) * z;
    const S c89 = S(1.0 / 20922789888000.0) - S(1.0 / 6402373705728000.0) * z;
    return (c01 + z2 * c23) + z4 * ((c45 + z2 * c67) + z4 * c89);
  }

  ActuatorParameters parameters_;
  double area_a_, area_b_, atmosphere_, atmosphere_force_, supply_, choked_flow_, fill_coefficient_,
      discharge_coefficient_, fill_choked_below_, exhaust_choked_above_, ratio_, heating_a_, heating_b_, dead_length_a_,
      dead_length_b_, position_min_, position_max_, block_weight_, gravity_amplitude_, angle_per_m_, inverse_mass_,
      static_, coulomb_, viscous_, motor_limit_;
  double critical_ratio_, choked_per_supply_;  // of the fill flow at another supply pressure
};

using ActuatorState = StateOf<PneumaticActuator>;

}  // namespace solenoid
