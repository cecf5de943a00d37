#pragma once

#include "core/mpc/hybrid_model.hpp"

#include <cmath>

#include <Eigen/Core>
#include <unsupported/Eigen/AutoDiff>

namespace Eigen {

/// Square root of a dual number whose derivative at zero is zero. Models cut the radicand off at zero, where the
/// general rule makes 0 times infinity of a derivative that is none.
template <int n>
AutoDiffScalar<Matrix<double, n, 1>> sqrt(const AutoDiffScalar<Matrix<double, n, 1>>& x) {
  const double root = std::sqrt(x.value());
  return {root, x.derivatives() * (root > 0.0 ? 0.5 / root : 0.0)};
}

}  // namespace Eigen

namespace solenoid {

/// d step / d state of any HybridModel by forward differentiation, J(i, j) = d x+[i] / d x[j]; exact on the branch of
/// the physics that x is on. Returns x+. No allocation.
template <HybridModel M>
StateOf<M> linearise(const M& model, const StateOf<M>& state, const SwitchedOf<M>& switched,
                     const ContinuousOf<M>& continuous, double dt,
                     Eigen::Matrix<double, int{M::state_size}, int{M::state_size}>& jacobian) noexcept {
  constexpr int n = M::state_size;
  using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, n, 1>>;
  Vector<Dual, M::state_size> x;
  Vector<Dual, M::switched_size> s;
  Vector<Dual, M::continuous_size> u;
  for (std::size_t i = 0; i < M::state_size; ++i) x[i] = Dual(state[i], n, static_cast<int>(i));
  for (std::size_t i = 0; i < M::switched_size; ++i) s[i] = Dual(switched[i]);
  for (std::size_t i = 0; i < M::continuous_size; ++i) u[i] = Dual(continuous[i]);
  const auto next = model.template step<Dual>(x, s, u, dt);
  StateOf<M> value;
  for (std::size_t i = 0; i < M::state_size; ++i) {
    value[i] = next[i].value();
    jacobian.row(static_cast<int>(i)) = next[i].derivatives().transpose();
  }
  return value;
}

}  // namespace solenoid
