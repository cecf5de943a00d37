#pragma once

#include "core/mpc/problem.hpp"

namespace solenoid {

/// The bang-bang double integrator: position'' = force, stepped exactly under a held force. Fuel is |force|.
///
/// Minimum-time closed form from (x0 > 0, 0) to rest at 0 with |force| <= 1: force -1 for sqrt(x0), then +1 for
/// sqrt(x0). (Pontryagin; any textbook on optimal control.)
struct DoubleIntegrator {
  static constexpr std::size_t state_size = 2, switched_size = 1, continuous_size = 1, output_size = 2;

  template <class S>
  Vector<S, 2> step(const Vector<S, 2>& x, const Vector<S, 1>& force, const Vector<S, 1>& push, double dt) const {
    const S a = force[0] + push[0];
    return {x[0] + S(dt) * x[1] + S(dt * dt / 2) * a, x[1] + S(dt) * a};
  }
  template <class S>
  Vector<S, 2> output(const Vector<S, 2>& x) const {
    return x;
  }
  /// Both coordinates rise with position, velocity and force: the corners of a box map to the corners of its image.
  template <class S>
  void enclose_step(Vector<S, 2>& low, Vector<S, 2>& high, const Vector<S, 1>& weakest, const Vector<S, 1>& strongest,
                    const Vector<double, 2>&, const Vector<double, 1>& push, double dt) const {
    low = step<S>(low, weakest, {S(push[0])}, dt);
    high = step<S>(high, strongest, {S(push[0])}, dt);
  }
  template <class S>
  S consumption(const Vector<S, 2>&, const Vector<S, 1>& force) const {
    return force[0] * force[0];
  }
};

/// Modes "left" (-1) and "right" (+1) of one switch.
inline ModeSet bang_bang(double rise_s = 0, double fall_s = 0, double dwell_s = 0) {
  return {"bang_bang", {{"thrust", rise_s, fall_s, dwell_s}}, {{"left", 0}, {"right", 1}}, {-1.0}, {{2.0}}};
}

/// Two switches, -1 each way, and coasting: three modes.
inline ModeSet bang_coast_bang(double rise_s = 0, double fall_s = 0, double dwell_s = 0) {
  return {"bang_coast_bang",
          {{"right", rise_s, fall_s, dwell_s}, {"left", rise_s, fall_s, dwell_s}},
          {{"coast", 0}, {"right", 1}, {"left", 2}},
          {0.0},
          {{1.0}, {-1.0}}};
}

}  // namespace solenoid
