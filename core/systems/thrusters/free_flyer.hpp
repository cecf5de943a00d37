#pragma once

#include "core/mpc/hybrid_model.hpp"
#include "core/mpc/sine_cosine.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace solenoid {

class TableReader;

/// The parameters are those of REACSA, the platform on air bearings of ESA's Orbital Robotics Laboratory, unless a
/// field says otherwise. Sources by number:
///
///   [1] F. Stark, mimpc, github.com/dfki-ric-underactuated-lab/mimpc, commit b4f6ae75,
///       include/systems/REACSA_constants.h, with the frame of src/systems/REACSA.cpp
///   [2] F. Stark, J. Middelberg, S. Vyas, Mixed-Integer vs. Continuous Model Predictive Control for Binary Thrusters,
///       EuroGNC 2026, arXiv 2603.19796: the comparison on this platform; no figure here is from it
///
/// REACSA has a reaction wheel too; it stands still here.
struct FreeFlyerParameters {
  double mass_kg = 202.81;        ///< [1] MASS_REACSA, the sum of its parts, tanks empty
  double inertia_kg_m2 = 12.223;  ///< [1] INERTIA_REACSA, about the vertical axis
  double thrust_n = 10.36;        ///< [1] FORCE_THRUSTER, of one thruster
  double lever_m = 0.35;          ///< [1] RADIUS_REACSA, from the centre of mass to a thruster's line of force
  /// Air through one open thruster: its thrust over 514 m/s, what air of 293 K reaches in an ideal nozzle from 8 bar to
  /// 1 bar, v = sqrt(7 R T (1 - 8^(-2/7))) (Sutton and Biblarz, Rocket Propulsion Elements, chapter 3). The pressure is
  /// assumed: a figure of the order of the platform's, not measured on it.
  double flow_kg_per_s = 0.0202;
  double least_on_s = 0.1;   ///< [1] TIME_THRUSTER_MIN_ON, until the nominal force is there
  double least_off_s = 0.2;  ///< [1] TIME_THRUSTER_MIN_OFF
  /// Until a commanded valve opens, and closes: of the order of a direct-acting solenoid valve's; no figure of the
  /// platform's was found.
  double rise_delay_s = 0.01, fall_delay_s = 0.01;
  /// A force on the centre of mass, in the floor's axes, and a torque: a floor out of level, a hose. The source has none.
  double external_force_x_n = 0.0, external_force_y_n = 0.0, external_torque_nm = 0.0;

  /// Throws ConfigError, naming the field; `where` begins the message.
  void validate(const std::string& where) const;
  bool operator==(const FreeFlyerParameters&) const = default;
};

/// Reads parameters by the names of the fields above; a table says those that differ. Throws ConfigError with file, line,
/// key and what is allowed.
FreeFlyerParameters read_free_flyer(TableReader& table);

/// A planar free-flyer with eight on/off thrusters: a disc on air bearings.
///
/// state       (x, y [m], angle [rad], vx, vy [m/s], rate [rad/s]) in the floor's axes
/// switched    s = thrusters, each in [0, 1]; force and torque are linear in them
/// output      z = the state
///
///     m (vx', vy') = R(angle) F(s) + external,   I rate' = l f T(s) + external,   angle' = rate
///     F_x = f (s3 + s6 - s2 - s7),  F_y = f (s0 + s5 - s1 - s4),  T = s0 + s2 + s4 + s6 - (s1 + s3 + s5 + s7)
///
/// The thrusters sit in pairs, back to back, on four sides at distance l, in the body's axes (REACSA.cpp of [1]):
///
///     thruster   0         1         2         3         4         5         6         7
///     at         (l, 0)    (l, 0)    (0, l)    (0, l)    (-l, 0)   (-l, 0)   (0, -l)   (0, -l)
///     pushes     +y        -y        -x        +x        -y        +y        +x        -x
///     turns      +         -         +         -         +         -         +         -
///
/// The mass is constant: a manoeuvre uses some grams of air, and the platform has two hundred kilograms.
///
/// step() holds the thrusters for dt. The angle is exact, a quadratic of time. The force is turned by the angle of half
/// the step and then held, so the motion is exact while the platform does not turn, and otherwise of second order: a step
/// is off by up to (|F|/m) |rate| dt^3/12 in the position and (|F|/m) (rate^2 + |rate'|) dt^3/24 in the velocity, and
/// by less of higher order.
class FreeFlyer {
 public:
  static constexpr std::size_t state_size = 6, switched_size = 8, continuous_size = 0, output_size = 6;

  /// Indices into the state.
  enum StateIndex : std::size_t { position_x, position_y, angle, velocity_x, velocity_y, rate };

  /// Throws ConfigError at parameters that are out of range.
  explicit FreeFlyer(const FreeFlyerParameters& parameters = {});

  const FreeFlyerParameters& parameters() const { return parameters_; }

  /// What an instance keeps of it (instance_set.hpp): accelerations [m/s2] and angular acceleration [rad/s2] from outside,
  /// in the floor's axes, in place of the parameters' force and torque.
  static constexpr std::size_t load_size = 3;
  Vector<double, load_size> load() const noexcept { return {external_x_, external_y_, external_turn_}; }
  void set_load(const Vector<double, load_size>& load) noexcept {
    external_x_ = load[0];
    external_y_ = load[1];
    external_turn_ = load[2];
  }

  /// What the thrusters do: acceleration in the body's axes [m/s2] and angular acceleration [rad/s2].
  template <class S>
  struct Push {
    S forward, sideways, turn;
  };
  template <class S>
  Push<S> push(const Vector<S, 8>& s) const {
    return push_between<S>(s, s);
  }

  template <class S>
  Vector<S, 6> step(const Vector<S, 6>& state, const Vector<S, 8>& thrusters, const Vector<S, 0>&, double dt) const {
    const Push<S> p = push<S>(thrusters);
    const SineCosine<S> turned = sine_cosine<S>(angle_after<S>(state, p.turn, dt / 2));
    const S ax = (turned.cosine * p.forward - turned.sine * p.sideways) + S(external_x_);
    const S ay = (turned.sine * p.forward + turned.cosine * p.sideways) + S(external_y_);
    return advance<S>(state, ax, ay, p.turn, dt);
  }

  template <class S>
  Vector<S, 6> output(const Vector<S, 6>& state) const {
    return state;
  }

  /// Air used [kg/s].
  template <class S>
  S consumption(const Vector<S, 6>&, const Vector<S, 8>& s) const {
    return S(parameters_.flow_kg_per_s) * (((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7])));
  }

  /// Says by how much the states move over two seconds with a pair of thrusters on for a part of it.
  Vector<double, 6> state_scale() const { return {0.1, 0.1, 0.5, 0.1, 0.1, 0.5}; }

  /// Moves a box [low, high] by a step, with thrusters anywhere in their own box: the image under step() of each point
  /// of the old box lies in the new one, up to rounding.
  ///
  /// Positions, velocities, angle and rate rise with each other and with the accelerations, so their ends map to ends.
  /// Of the angle at half the step, middle +- h, the cosine is within |sin middle| h + h^2/2 of cos middle (Taylor, its
  /// second derivative being at most 1), the sine likewise, and both are within [-1, 1]. A product of intervals is
  /// extreme at two of its ends.
  template <class S>
  void enclose_step(Vector<S, 6>& low, Vector<S, 6>& high, const Vector<S, 8>& least, const Vector<S, 8>& most,
                    const Vector<double, 6>&, const Vector<double, 0>&, double dt) const {
    using std::abs;
    const Push<S> weak = push_between<S>(least, most), strong = push_between<S>(most, least);
    const S angle_low = angle_after<S>(low, weak.turn, dt / 2), angle_high = angle_after<S>(high, strong.turn, dt / 2);
    const S half = S(0.5) * (angle_high - angle_low), bend = S(0.5) * (half * half);
    const SineCosine<S> middle = sine_cosine<S>(S(0.5) * (angle_low + angle_high));
    const Interval<S> cosine = around<S>(middle.cosine, S(S(abs(middle.sine)) * half + bend));
    const Interval<S> sine = around<S>(middle.sine, S(S(abs(middle.cosine)) * half + bend));
    const Interval<S> forward{weak.forward, strong.forward}, sideways{weak.sideways, strong.sideways};
    const Interval<S> x_forward = product<S>(cosine, forward), x_sideways = product<S>(sine, sideways);
    const Interval<S> y_forward = product<S>(sine, forward), y_sideways = product<S>(cosine, sideways);
    low = advance<S>(low, (x_forward.low - x_sideways.high) + S(external_x_),
                     (y_forward.low + y_sideways.low) + S(external_y_), weak.turn, dt);
    high = advance<S>(high, (x_forward.high - x_sideways.low) + S(external_x_),
                      (y_forward.high + y_sideways.high) + S(external_y_), strong.turn, dt);
  }

 private:
  template <class S>
  struct Interval {
    S low, high;
  };

  /// The push of thrusters that `on` has where they push or turn positively, and `against` where negatively: of the
  /// ends of a box, its least and greatest values.
  template <class S>
  Push<S> push_between(const Vector<S, 8>& on, const Vector<S, 8>& against) const {
    return {S(S(per_thruster_) * ((on[3] + on[6]) - (against[2] + against[7]))),
            S(S(per_thruster_) * ((on[0] + on[5]) - (against[1] + against[4]))),
            S(S(turn_per_thruster_) *
                  (((on[0] + on[2]) + (on[4] + on[6])) - ((against[1] + against[3]) + (against[5] + against[7]))) +
              S(external_turn_))};
  }

  template <class S>
  static S angle_after(const Vector<S, 6>& state, const S& turn, double dt) {
    return state[angle] + S(dt) * state[rate] + S(dt * dt / 2) * turn;
  }

  /// The state after dt of constant accelerations.
  template <class S>
  static Vector<S, 6> advance(const Vector<S, 6>& state, const S& ax, const S& ay, const S& turn, double dt) {
    const S half_square(dt * dt / 2);
    return {S(state[position_x] + S(dt) * state[velocity_x] + half_square * ax),
            S(state[position_y] + S(dt) * state[velocity_y] + half_square * ay),
            angle_after<S>(state, turn, dt),
            S(state[velocity_x] + S(dt) * ax),
            S(state[velocity_y] + S(dt) * ay),
            S(state[rate] + S(dt) * turn)};
  }

  /// [value - slack, value + slack] within [-1, 1].
  template <class S>
  static Interval<S> around(const S& value, const S& slack) {
    using std::max;
    using std::min;
    return {S(max(S(value - slack), S(-1.0))), S(min(S(value + slack), S(1.0)))};
  }

  template <class S>
  static Interval<S> product(const Interval<S>& a, const Interval<S>& b) {
    using std::max;
    using std::min;
    const S ll = a.low * b.low, lh = a.low * b.high, hl = a.high * b.low, hh = a.high * b.high;
    return {S(min(S(min(ll, lh)), S(min(hl, hh)))), S(max(S(max(ll, lh)), S(max(hl, hh))))};
  }

  FreeFlyerParameters parameters_;
  double per_thruster_, turn_per_thruster_;         // one thruster's acceleration and angular acceleration
  double external_x_, external_y_, external_turn_;  // accelerations
};

}  // namespace solenoid
