#pragma once

#include <cmath>
#include <span>

#include <solenoid/core/mpc/hybrid_model.hpp>

namespace plugin_name {

/// A plate with a heater that is on or off, on a block that the air cools:
///
///     C_p dT_p/dt = (T_b - T_p)/R + P s                    T_p: of the plate [degC]    s: 0 or 1
///     C_b dT_b/dt = (T_p - T_b)/R + (T_a - T_b)/R_a        T_b: of the block
///
/// A step is one of the classical Runge-Kutta method.
class Plate {
 public:
  static constexpr std::size_t state_size = 2, switched_size = 1, continuous_size = 0, output_size = 1;

  /// power_w, air_c, plate_j_per_k, block_j_per_k, inner_k_per_w, air_k_per_w, in this order.
  explicit Plate(std::span<const double> p)
      : power_w_(p[0]),
        air_c_(p[1]),
        plate_j_per_k_(p[2]),
        block_j_per_k_(p[3]),
        inner_k_per_w_(p[4]),
        air_k_per_w_(p[5]) {}

  template <class S>
  solenoid::Vector<S, 2> rate(const solenoid::Vector<S, 2>& x, const solenoid::Vector<S, 1>& s) const {
    const S upwards = (x[1] - x[0]) * S(1.0 / inner_k_per_w_), cooling = (S(air_c_) - x[1]) * S(1.0 / air_k_per_w_);
    return {S((upwards + S(power_w_) * s[0]) * S(1.0 / plate_j_per_k_)),
            S((cooling - upwards) * S(1.0 / block_j_per_k_))};
  }
  template <class S>
  solenoid::Vector<S, 2> step(const solenoid::Vector<S, 2>& x, const solenoid::Vector<S, 1>& s,
                              const solenoid::Vector<S, 0>&, double dt) const {
    const auto after = [&](const solenoid::Vector<S, 2>& rate, double time) {
      return solenoid::Vector<S, 2>{S(x[0] + S(time) * rate[0]), S(x[1] + S(time) * rate[1])};
    };
    const auto k1 = rate(x, s), k2 = rate(after(k1, dt / 2), s), k3 = rate(after(k2, dt / 2), s),
               k4 = rate(after(k3, dt), s);
    solenoid::Vector<S, 2> next;
    for (std::size_t i = 0; i < 2; ++i) next[i] = x[i] + S(dt / 6) * ((k1[i] + k4[i]) + S(2.0) * (k2[i] + k3[i]));
    return next;
  }
  template <class S>
  solenoid::Vector<S, 1> output(const solenoid::Vector<S, 2>& x) const {
    return {x[0]};
  }
  /// What the heater takes [J/s].
  template <class S>
  S consumption(const solenoid::Vector<S, 2>&, const solenoid::Vector<S, 1>& s) const {
    return S(power_w_) * s[0];
  }

 private:
  double power_w_, air_c_, plate_j_per_k_, block_j_per_k_, inner_k_per_w_, air_k_per_w_;
};

}  // namespace plugin_name
