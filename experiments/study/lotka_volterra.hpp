#pragma once

#include "core/mpc/problem.hpp"

#include <cmath>
#include <span>

namespace solenoid {

/// The Lotka-Volterra fishing problem (Sager; mintoc.de): when to fish so that prey x and predators y settle at (1, 1).
///
///     x' = x - x y - 0.4 x w,   y' = -y + x y - 0.2 y w,   w in {0, 1}
///     minimise the integral of (x - 1)^2 + (y - 1)^2 over [0, 12] from (0.5, 0.7)
///
/// Published: 1.34408 with w in [0, 1]; 1.38276 with w in {0, 1} and two switches.
/// step() is `substeps` classical Runge-Kutta steps of dt / substeps under a held w.
struct LotkaVolterraFishing {
  static constexpr std::size_t state_size = 2, switched_size = 1, continuous_size = 0, output_size = 2;
  static constexpr int substeps = 2;

  template <class S>
  Vector<S, 2> step(const Vector<S, 2>& stocks, const Vector<S, 1>& fishing, const Vector<S, 0>&, double dt) const {
    Vector<S, 2> z = stocks;
    for (int i = 0; i < substeps; ++i) z = runge_kutta<S>(z, fishing[0], dt / substeps);
    return z;
  }
  template <class S>
  Vector<S, 2> output(const Vector<S, 2>& stocks) const {
    return stocks;
  }

 private:
  template <class S>
  static Vector<S, 2> rate(const S& x, const S& y, const S& w) {
    return {x * (S(1.0) - y - S(0.4) * w), y * (x - S(1.0) - S(0.2) * w)};
  }
  template <class S>
  static Vector<S, 2> runge_kutta(const Vector<S, 2>& z, const S& w, double h) {
    const S half(h / 2), sixth(h / 6), two(2.0);
    const Vector<S, 2> a = rate<S>(z[0], z[1], w);
    const Vector<S, 2> b = rate<S>(z[0] + half * a[0], z[1] + half * a[1], w);
    const Vector<S, 2> c = rate<S>(z[0] + half * b[0], z[1] + half * b[1], w);
    const Vector<S, 2> d = rate<S>(z[0] + S(h) * c[0], z[1] + S(h) * c[1], w);
    return {z[0] + sixth * (a[0] + two * (b[0] + c[0]) + d[0]), z[1] + sixth * (a[1] + two * (b[1] + c[1]) + d[1])};
  }
};

inline ModeSet fishing_modes() { return {"fishing", {{"fleet"}}, {{"ashore", 0}, {"fishing", 1}}, {0.0}, {{1.0}}}; }

/// The problem over these blocks of steps dt. Its cost is the integral by the right-hand rectangle rule: a weight of dt
/// on every step. The trapezium rule is (dt/2) (|e[0]|^2 - |e[N]|^2) more, the first part the same for every plan and
/// the second negligible once the stocks have settled; fishing_integral() adds both.
inline Problem<LotkaVolterraFishing> fishing_problem(double dt, std::vector<int> blocks, double switching = 0.0) {
  Cost<LotkaVolterraFishing> cost;
  cost.tracking = {dt, dt};
  cost.switching = switching;
  Problem<LotkaVolterraFishing> problem({}, fishing_modes(), {dt, std::move(blocks)}, cost);
  problem.initial = {0.5, 0.7};
  problem.reference.assign(problem.reference.size(), {1.0, 1.0});
  return problem;
}

/// The integral of a plan's predicted outputs by the trapezium rule.
inline double fishing_integral(const Problem<LotkaVolterraFishing>& problem,
                               std::span<const OutputOf<LotkaVolterraFishing>> outputs) {
  const auto square = [](const Vector<double, 2>& z) {
    return (z[0] - 1.0) * (z[0] - 1.0) + (z[1] - 1.0) * (z[1] - 1.0);
  };
  double sum = 0.5 * (square(problem.initial) - square(outputs.back()));
  for (const auto& z : outputs) sum += square(z);
  return problem.horizon.dt_s * sum;
}

}  // namespace solenoid
