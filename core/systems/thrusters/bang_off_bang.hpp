#pragma once

#include <cmath>
#include <stdexcept>

namespace solenoid {

/// The least-fuel way of a double integrator from rest to rest over `distance_m` in exactly `duration_s`, by an
/// acceleration u(t), |u| <= a: full thrust, coast, full thrust against it.
///
///     u = +a on [0, t1],  0 on (t1, T - t1),  -a on [T - t1, T];     d = a t1 (T - t1)
///     t1 = (T - sqrt(T^2 - 4 d/a)) / 2,   burn = 2 t1,   a solution if and only if T >= 2 sqrt(d/a)
///
/// (M. Athans, P. L. Falb, Optimal Control, McGraw-Hill 1966, chapter 8; A. E. Bryson, Y.-C. Ho, Applied Optimal Control,
/// 1975, chapter 3.) Why it is the least: from rest to rest a burn of 2 t1 in all speeds up and slows down for t1 each at
/// most, so the speed at t is at most a min(t1, t, T - t) and the distance at most a t1 (T - t1), reached by this way
/// alone; and that rises with t1 up to T/2.
struct BangOffBang {
  double burn_s;   ///< t1, of each of the two burns
  double coast_s;  ///< T - 2 t1
  double speed;    ///< while coasting [m/s]

  /// The fuel of both burns [kg] at this flow while thrusting.
  double fuel_kg(double flow_kg_per_s) const { return 2.0 * burn_s * flow_kg_per_s; }
};

/// Returns it for d >= 0, a > 0. Throws std::invalid_argument where the duration is shorter than 2 sqrt(d/a).
inline BangOffBang bang_off_bang(double distance_m, double acceleration, double duration_s) {
  if (!(distance_m >= 0.0 && acceleration > 0.0))
    throw std::invalid_argument("bang-off-bang: needs a distance >= 0 and an acceleration > 0");
  const double square = duration_s * duration_s, four = 4.0 * distance_m / acceleration;
  if (!(duration_s > 0.0 && square >= four))
    throw std::invalid_argument("bang-off-bang: the duration is shorter than the least time 2 sqrt(d/a)");
  const double root = std::sqrt(square - four);
  const double burn = 0.5 * four / (duration_s + root);  // the smaller root, without the difference of near numbers
  return {burn, root, acceleration * burn};
}

}  // namespace solenoid
