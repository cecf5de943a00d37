#pragma once

#include "core/mpc/hybrid_model.hpp"
#include "core/systems/actuator/parameters.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {

/// Indices into the actuator's vectors.
enum StateIndex : std::size_t { position = 0, velocity = 1, pressure_a = 2, pressure_b = 3 };
/// Indices into its switched inputs, the valves' openings.
enum OpeningIndex : std::size_t { fill_a = 0, exhaust_a = 1, fill_b = 2, exhaust_b = 3 };

/// The hybrid pneumatic-electric actuator is one piece of physics for controllers, solvers, estimators and plants.
///
/// state       x = (y [m], v [m/s], Pa, Pb [Pa absolute])
/// switched    s = valve openings (fill A, exhaust A, fill B, exhaust B), each in [0, 1]; the flow is affine in them
/// continuous  u = motor force [N], saturated at the amplifier's limit
/// output      z = (y [m], v [m/s])
///
///     V_a dPa/dt = k R T mdot_a - k Pa A_a v,   V_a = (y_a0 + y) A_a                           (4.18, 4.19, 4.21)
///     V_b dPb/dt = k R T mdot_b + k Pb A_b v,   V_b = (y_b0 - y) A_b                           (4.20, 4.22 with E3)
///     mdot       = s_fill fill(P) + s_exhaust exhaust(P)                                       (5.7, 5.8)
///     m_eq dv/dt = Pa A_a - Pb A_b - P_0 (A_a - A_b) + F_grav(y) + F_m - F_fric                (4.1-4.14, E9)
///
/// The numbers are the thesis's; model.md, eq. 1 to 11, has the equations with their misprints mended.
///
/// step() is the explicit Euler method of the thesis (5.4) with three non-smooth corrections: a slide at rest stays
/// while |applied force| <= F_sf; a velocity that would change its sign stops at zero; end stops are inelastic.
///
/// A prediction is one long chain of such steps, so the sums in it are grouped by what arrives last (the square root,
/// the arm's sine): what matters is the longest way from one state to the next, not the number of operations.
class PneumaticActuator {
 public:
  static constexpr std::size_t state_size = 4, switched_size = 4, continuous_size = 1, output_size = 2;

  explicit PneumaticActuator(const ActuatorParameters& parameters = {});

  const ActuatorParameters& parameters() const { return parameters_; }

  /// Flow into a chamber through its fully open supply valve [kg/s], (5.8); none where (5.8) has no real value, at
  /// chamber pressures above supply. Times `scale`, which meets the constants first: a scale that is held, like an
  /// opening, costs nothing in a loop over time.
  template <class S>
  S fill_flow(const S& pressure) const {
    return scaled_fill_flow<S>(S(1.0), pressure);
  }
  template <class S>
  S scaled_fill_flow(const S& scale, const S& pressure) const {
    using std::max, std::sqrt;
    // A head of 1e-30 Pa is none, and its root keeps a finite derivative for dual numbers.
    const S root = sqrt(S(max(S(S(supply_) - pressure), S(1e-30))));
    return select(pressure < S(fill_choked_below_), S(scale * S(choked_flow_)),
                  S(S(scale * S(fill_coefficient_)) * root));
  }

  /// Flow into a chamber through its fully open exhaust valve [kg/s], negative above atmosphere, (5.7).
  template <class S>
  S exhaust_flow(const S& pressure) const {
    return scaled_exhaust_flow<S>(S(1.0), pressure);
  }
  template <class S>
  S scaled_exhaust_flow(const S& scale, const S& pressure) const {
    return select(pressure > S(exhaust_choked_above_), S(scale * S(-choked_flow_)),
                  S(S(scale * S(discharge_coefficient_)) * (S(atmosphere_) - pressure)));
  }

  /// Gravity on the slide [N], (4.8).
  template <class S>
  S gravity_force(const S& y) const {
    return S(block_weight_) - S(own_.gravity_amplitude) * sine_of_arm_angle(y);
  }

  /// These conditions change from one run to the next, and an estimator may carry them as states of any scalar.
  template <class C>
  struct Conditions {
    C inverse_mass;       ///< [1/kg]
    C gravity_amplitude;  ///< of arm and payload [N]
    C external_force;     ///< on the slide, towards +y [N]
    C stiction, coulomb, viscous;
  };
  /// Returns the conditions under this payload [kg], an external force [N] and friction times a factor.
  template <class S>
  Conditions<S> conditions(const S& payload_kg, const S& external_force_n, const S& friction) const {
    return {S(S(1.0) / S(S(mass_without_payload_) + S(mass_per_payload_) * payload_kg)),
            S(S(gravity_without_payload_) + S(gravity_per_payload_) * payload_kg),
            external_force_n,
            S(S(own_.stiction) * friction),
            S(S(own_.coulomb) * friction),
            S(S(own_.viscous) * friction)};
  }
  /// Makes this load the model's own, friction unchanged: what a controller does with an estimate each period.
  void set_load(double payload_kg, double external_force_n) noexcept;
  /// The same as what an instance keeps of it (instance_set.hpp): payload [kg], external force [N].
  static constexpr std::size_t load_size = 2;
  Vector<double, load_size> load() const noexcept { return {parameters_.payload_mass_kg, own_.external_force}; }
  void set_load(const Vector<double, load_size>& load) noexcept { set_load(load[0], load[1]); }

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
    return S(own_.coulomb) * direction + S(own_.viscous) * v;
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
    using std::max;
    using std::min;
    return min(max(force, S(-motor_limit_)), S(motor_limit_));
  }

  /// Velocity after dt under the applied force (everything but friction), (4.2) with the friction law (4.14).
  template <class S>
  S velocity_after(const S& v, const S& applied, double dt) const {
    return velocity_after<S>(v, applied, dt, own_);
  }
  template <class S, class C>
  S velocity_after(const S& v, const S& applied, double dt, const Conditions<C>& c) const {
    using std::abs;
    const S per_force(dt * c.inverse_mass);
    const S glide = S(S(1.0) - per_force * S(c.viscous)) * v, coulomb = per_force * S(c.coulomb);
    const auto at_rest = v == S(0.0);
    const auto moves_back = (v < S(0.0)) | (at_rest & (applied < S(0.0)));
    const S next = (glide + per_force * applied) - select(moves_back, S(-coulomb), coulomb);
    const auto reverses = S(v * next) < S(0.0);
    const auto sticks = at_rest & (S(abs(applied)) <= S(c.stiction));
    return select(reverses | sticks, S(0.0), next);
  }

  template <class S>
  Vector<S, 4> step(const Vector<S, 4>& x, const Vector<S, 4>& opening, const Vector<S, 1>& motor, double dt) const {
    return step_under<S>(x, opening, motor, dt, own_);
  }

  /// step() under other conditions than the model's own.
  template <class S, class C>
  Vector<S, 4> step_under(const Vector<S, 4>& x, const Vector<S, 4>& opening, const Vector<S, 1>& motor, double dt,
                          const Conditions<C>& c) const {
    const S v_free = velocity_after<S>(x[velocity], applied_force<S>(x, motor, c), dt, c);
    return advance<S>(x, opening, v_free, dt);
  }

  /// step() without stiction and with the Coulomb force as F_cf tanh(v / creep_speed_m_per_s): a slide that step()
  /// would hold creeps, and inputs have a derivative. Off by at most dt/m_eq (F_sf + F_cf) in the velocity of a step at
  /// or through rest, and by dt/m_eq F_cf (1 - tanh(|v| / creep speed)) in motion. The flow's jumps stay as they are.
  template <class S>
  Vector<S, 4> smooth_step(const Vector<S, 4>& x, const Vector<S, 4>& opening, const Vector<S, 1>& motor,
                           double dt) const {
    using std::tanh;
    const S& v = x[velocity];
    const S applied = applied_force<S>(x, motor, own_);
    const S friction = S(own_.coulomb) * S(tanh(S(v * S(1.0 / creep_speed_m_per_s)))) + S(own_.viscous) * v;
    return advance<S>(x, opening, S(v + S(dt * own_.inverse_mass) * (applied - friction)), dt);
  }
  static constexpr double creep_speed_m_per_s = 0.002;

  /// Says by how much the states move over a tenth of a second.
  Vector<double, 4> state_scale() const { return {1e-3, 1e-1, 1e5, 1e5}; }

  template <class S>
  Vector<S, 2> output(const Vector<S, 4>& x) const {
    return {x[position], x[velocity]};
  }

  /// Supply air drawn [kg/s].
  template <class S>
  S consumption(const Vector<S, 4>& x, const Vector<S, 4>& opening) const {
    return scaled_fill_flow<S>(opening[fill_a], x[pressure_a]) + scaled_fill_flow<S>(opening[fill_b], x[pressure_b]);
  }

  /// Moves a box [low, high] by a step, with openings and motor force anywhere in their own boxes: the image under
  /// step() of each point of the old box lies in the new one, up to rounding.                    [theory.md, section 3]
  template <class S>
  void enclose_step(Vector<S, 4>& low, Vector<S, 4>& high, const Vector<S, 4>& opening_low,
                    const Vector<S, 4>& opening_high, const Vector<double, 2>&, const Vector<double, 1>& motor,
                    double dt) const {
    const S force = saturated_motor_force<S>(S(motor[0]));
    enclose_step<S>(low, high, opening_low, opening_high, force, force, dt);
  }
  template <class S>
  void enclose_step(Vector<S, 4>& low, Vector<S, 4>& high, const Vector<S, 4>& opening_low,
                    const Vector<S, 4>& opening_high, const S& motor_low, const S& motor_high, double dt) const {
    using std::max;
    using std::min;
    const auto inside_stops = [&](const S& y) { return S(min(S(max(y, S(position_min_))), S(position_max_))); };
    const S y_low = inside_stops(low[position] + S(dt) * low[velocity]);
    const S y_high = inside_stops(high[position] + S(dt) * high[velocity]);
    const S middle = S(0.5) * (low[position] + high[position]), half = S(0.5) * (high[position] - low[position]);
    const S gravity = gravity_force<S>(middle) + S(own_.external_force);
    const S slack = S(own_.gravity_amplitude * angle_per_m_) * half;
    const S applied_low = cylinder_force<S>(low[pressure_a], high[pressure_b]) + gravity - slack + motor_low;
    const S applied_high = cylinder_force<S>(high[pressure_a], low[pressure_b]) + gravity + slack + motor_high;
    const S v_low = velocity_after<S>(low[velocity], applied_low, dt);
    const S v_high = velocity_after<S>(high[velocity], applied_high, dt);

    const S a_short = S(dead_length_a_) + low[position], a_long = S(dead_length_a_) + high[position];
    const S b_short = S(dead_length_b_) - high[position], b_long = S(dead_length_b_) - low[position];
    const Vector<S, 2> pa = enclose_pressure<S>(low[pressure_a], high[pressure_a], low[velocity], high[velocity],
                                                a_short, a_long, heating_a_, opening_low, opening_high, fill_a, dt);
    const Vector<S, 2> pb = enclose_pressure<S>(low[pressure_b], high[pressure_b], -high[velocity], -low[velocity],
                                                b_short, b_long, heating_b_, opening_low, opening_high, fill_b, dt);
    // A stop ends only motion towards it, so it can raise the lowest velocity and lower the highest one, not the
    // reverse. Velocities and pressures are cut where no state of the actuator is, so that a box that says nothing
    // stays finite.
    const S v_lowest = select(y_high < S(position_max_), v_low, S(min(v_low, S(0.0))));
    const S v_highest = select(y_low > S(position_min_), v_high, S(max(v_high, S(0.0))));
    low = {y_low, S(max(v_lowest, S(-1e4))), pa[0], pb[0]};
    high = {y_high, S(min(v_highest, S(1e4))), S(min(pa[1], S(1e9))), S(min(pb[1], S(1e9)))};
  }

  /// Returns the nearest state inside the end stops with pressures between vacuum and twice supply: a prediction starts
  /// from it when a measurement is noisy.
  Vector<double, 4> nearest_valid(const Vector<double, 4>& x) const;

 private:
  /// Returns the sum of all forces but friction [N], (4.1).
  template <class S, class C>
  S applied_force(const Vector<S, 4>& x, const Vector<S, 1>& motor, const Conditions<C>& c) const {
    const S load = S(block_weight_ - atmosphere_force_ + c.external_force) + saturated_motor_force<S>(motor[0]);
    return (S(area_a_) * x[pressure_a] - S(area_b_) * x[pressure_b]) +
           (load - S(c.gravity_amplitude) * sine_of_arm_angle<S>(x[position]));
  }

  /// Returns the state after a step whose velocity, but for the stops, is v_free.
  template <class S>
  Vector<S, 4> advance(const Vector<S, 4>& x, const Vector<S, 4>& opening, const S& v_free, double dt) const {
    const auto& [y, v, pa, pb] = x;
    const S length_a = column_a<S>(y), length_b = column_b<S>(y);
    const S per_lengths = S(dt) / (length_a * length_b);  // one division for both chambers
    const S kv = S(ratio_) * v;
    const S pa_next = pa + (scaled_fill_flow<S>(S(heating_a_) * opening[fill_a], pa) +
                            (scaled_exhaust_flow<S>(S(heating_a_) * opening[exhaust_a], pa) - pa * kv)) *
                               (length_b * per_lengths);
    const S pb_next = pb + (scaled_fill_flow<S>(S(heating_b_) * opening[fill_b], pb) +
                            (scaled_exhaust_flow<S>(S(heating_b_) * opening[exhaust_b], pb) + pb * kv)) *
                               (length_a * per_lengths);
    using std::max, std::min;
    const S y_free = y + S(dt) * v;
    // By select and not by min and max: a position that is no number must stay none.
    const S y_next = select(y_free < S(position_min_), S(position_min_),
                            select(y_free > S(position_max_), S(position_max_), y_free));
    const S v_next = select(y_free < S(position_min_), S(max(v_free, S(0.0))),
                            select(y_free > S(position_max_), S(min(v_free, S(0.0))), v_free));
    return {y_next, v_next, S(max(pa_next, S(0.0))), S(max(pb_next, S(0.0)))};
  }

  /// Bounds of P + (heating flow(P) - k P w) dt / length over a box of pressures, outward velocities w and chamber
  /// lengths. The map rises with P except across the jumps of the flow law, near supply pressure (infinite slope of the
  /// root) and in very short chambers; there the extremes between the ends are added as candidates.
  template <class S>
  Vector<S, 2> enclose_pressure(const S& p_low, const S& p_high, const S& w_low, const S& w_high, const S& shortest,
                                const S& longest, double heating, const Vector<S, 4>& open_low,
                                const Vector<S, 4>& open_high, std::size_t fill, double dt) const {
    using std::max;
    using std::min;
    const S per_short = S(dt) / shortest, per_long = S(dt) / longest, h(heating), k(ratio_);
    const auto at = [&](const S& p, const S& flow, const S& w) {
      const S rate = h * flow - k * (p * w);
      return Vector<S, 2>{p + rate * select(rate < S(0.0), per_short, per_long),
                          p + rate * select(rate < S(0.0), per_long, per_short)};
    };
    const S& fill_open = open_high[fill];
    const S& exhaust_open = open_high[fill + 1];
    const auto most = [&](const S& p) {
      return fill_open * fill_flow<S>(p) +
             select(p < S(atmosphere_), exhaust_open, open_low[fill + 1]) * exhaust_flow<S>(p);
    };
    const auto least = [&](const S& p) {
      return open_low[fill] * fill_flow<S>(p) +
             select(p < S(atmosphere_), open_low[fill + 1], exhaust_open) * exhaust_flow<S>(p);
    };
    S bottom = min(at(p_low, least(p_low), w_high)[0], at(p_high, least(p_high), w_high)[0]);
    S top = max(at(p_low, most(p_low), w_low)[1], at(p_high, most(p_high), w_low)[1]);

    const S fill_edge(fill_choked_below_), exhaust_edge(exhaust_choked_above_);
    const auto fill_jump = (p_low < fill_edge) & (fill_edge < p_high);
    const S above_fill = at(fill_edge, fill_open * S(choked_flow_), w_low)[1];
    top = select(fill_jump & (fill_open > S(0.0)), max(top, above_fill), top);
    const auto exhaust_jump = (p_low < exhaust_edge) & (exhaust_edge < p_high);
    const S below_exhaust = at(exhaust_edge, exhaust_open * S(-choked_flow_), w_high)[0];
    bottom = select(exhaust_jump, min(bottom, below_exhaust), bottom);

    const S slope = h * S(fill_coefficient_) * per_short, reach = S(0.25) * slope * slope;
    const S peak = S(supply_) + reach - k * (p_high * min(w_low, S(0.0))) * per_short;
    top = select((S(supply_) - reach < p_high) & (fill_open > S(0.0)), max(top, peak), top);
    return {max(bottom, S(0.0)), max(top, S(0.0))};
  }

  /// sin(2 y/d_pitch) for the arm's angles over the stroke: cos of the angle from a horizontal arm, as the polynomial
  /// in its square that interpolates it at the Chebyshev nodes; below 2e-14 for angles up to 1.8 rad. A polynomial, so
  /// that double, SIMD and dual numbers round alike.
  template <class S>
  S sine_of_arm_angle(const S& y) const {
    const S phi = S(angle_per_m_) * y - S(std::numbers::pi / 2);
    const S z = phi * phi, z2 = z * z, z4 = z2 * z2;
    const S c01 = S(0.999999999999983) - S(0.4999999999993292) * z;
    const S c23 = S(0.041666666662317164) - S(0.0013888888781404974) * z;
    const S c45 = S(2.4801574250893997e-05) - S(2.755645795239747e-07) * z;
    const S c67 = S(2.0845214612515557e-09) - S(1.0866659971812875e-11) * z;
    return (c01 + z2 * c23) + z4 * (c45 + z2 * c67);
  }

  ActuatorParameters parameters_;
  double area_a_, area_b_, atmosphere_, atmosphere_force_, supply_, choked_flow_, fill_coefficient_,
      discharge_coefficient_, fill_choked_below_, exhaust_choked_above_, ratio_, heating_a_, heating_b_, dead_length_a_,
      dead_length_b_, position_min_, position_max_, block_weight_, angle_per_m_, motor_limit_;
  double critical_ratio_, choked_per_supply_;  // of the fill flow at another supply pressure
  double mass_without_payload_, mass_per_payload_, gravity_without_payload_, gravity_per_payload_;
  Conditions<double> own_;
};

/// The actuator's state, by StateIndex.
using ActuatorState = StateOf<PneumaticActuator>;

}  // namespace solenoid
