#pragma once

#include "solvers/qp/ocp_qp.hpp"
#include "solvers/qp/sparse_qp.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid::qp {

/// What an independent judge finds of a claimed solution, from the problem's data alone. Largest entries, unscaled.
struct KktError {
  double stationarity = 0.0;
  double primal = 0.0;           ///< equalities and bounds
  double dual = 0.0;             ///< multipliers pressing against a bound that does not exist
  double complementarity = 0.0;  ///< multiplier times distance to the bound it presses on
  double objective = 0.0;

  /// NaN counts as infinite.
  double largest() const {
    double most = 0.0;
    for (const double part : {stationarity, primal, dual, complementarity})
      most = std::isfinite(part) ? std::max(most, part) : HUGE_VAL;
    return std::isfinite(objective) ? most : HUGE_VAL;
  }
};

namespace judge {

inline void raise(double& most, double value) { most = std::isnan(value) ? HUGE_VAL : std::max(most, value); }

/// lower <= value <= upper with signed multiplier z.
inline void bound(KktError& error, double value, double lower, double upper, double z) {
  raise(error.primal, std::max({0.0, lower - value, value - upper}));
  const double pressed_on = z > 0.0 ? upper : lower;
  if (z == 0.0) return;
  if (std::isinf(pressed_on))
    raise(error.dual, std::abs(z));
  else
    raise(error.complementarity, std::abs(z * (value - pressed_on)));
}

inline Eigen::VectorXd hessian_times(const SparseQp& qp, const Eigen::VectorXd& x) {
  return qp.p_matrix.selfadjointView<Eigen::Upper>() * x;
}

/// A ray's inner product with the bounds it presses on; HUGE_VAL where it presses on none.
inline double support(const Eigen::VectorXd& z, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
  double total = 0.0;
  for (Eigen::Index i = 0; i < z.size(); ++i)
    if (z[i] != 0.0) total += z[i] * (z[i] > 0.0 ? upper[i] : lower[i]);
  return total;
}

}  // namespace judge

/// The residuals of a sparse QP's solution, from the problem's own data.
inline KktError kkt_error(const SparseQp& qp, const SparseSolution& at) {
  KktError error;
  const Eigen::VectorXd curvature = judge::hessian_times(qp, at.x);
  const Eigen::VectorXd gradient =
      curvature + qp.c + qp.a_matrix.transpose() * at.y + qp.g_matrix.transpose() * at.z_g + at.z_box;
  const Eigen::VectorXd defect = qp.a_matrix * at.x - qp.b, rows = qp.g_matrix * at.x;
  for (const double entry : gradient) judge::raise(error.stationarity, std::abs(entry));
  for (const double entry : defect) judge::raise(error.primal, std::abs(entry));
  for (Eigen::Index i = 0; i < at.x.size(); ++i) judge::bound(error, at.x[i], qp.lower[i], qp.upper[i], at.z_box[i]);
  for (Eigen::Index i = 0; i < rows.size(); ++i) judge::bound(error, rows[i], qp.g_lower[i], qp.g_upper[i], at.z_g[i]);
  error.objective = 0.5 * at.x.dot(curvature) + qp.c.dot(at.x);
  return error;
}

/// Straight from the stage form; shares nothing with the solver's packed layout or with to_sparse.
template <int NX, int NU>
KktError kkt_error(const OcpQp<NX, NU>& qp, const OcpSolution<NX, NU>& at) {
  using X = Eigen::Matrix<double, NX, 1>;
  using U = Eigen::Matrix<double, NU, 1>;
  KktError error;
  const auto last = static_cast<std::size_t>(qp.horizon());
  judge::raise(error.primal, (at.x[0] - qp.x0).template lpNorm<Eigen::Infinity>());
  for (std::size_t k = 0; k <= last; ++k) {
    const auto& stage = qp.stages[k];
    X state = stage.q_matrix * at.x[k] + stage.q;
    if (k < last) {
      const X defect = stage.a * at.x[k] + stage.b * at.u[k] + stage.c - at.x[k + 1];
      judge::raise(error.primal, defect.template lpNorm<Eigen::Infinity>());
      const U input =
          stage.r_matrix * at.u[k] + stage.s_matrix * at.x[k] + stage.r + stage.b.transpose() * at.y[k] + at.zu[k];
      judge::raise(error.stationarity, input.template lpNorm<Eigen::Infinity>());
      for (int j = 0; j < NU; ++j) judge::bound(error, at.u[k][j], stage.u_lower[j], stage.u_upper[j], at.zu[k][j]);
      state += stage.s_matrix.transpose() * at.u[k] + stage.a.transpose() * at.y[k];
      error.objective += 0.5 * at.u[k].dot(stage.r_matrix * at.u[k]) + at.u[k].dot(stage.s_matrix * at.x[k] + stage.r);
    }
    if (k == 0) continue;  // x_0 is a constant; its own share of the cost is not counted
    error.objective += 0.5 * at.x[k].dot(stage.q_matrix * at.x[k]) + stage.q.dot(at.x[k]);
    state += at.zx[k] - at.y[k - 1];
    judge::raise(error.stationarity, state.template lpNorm<Eigen::Infinity>());
    if (qp.state_bounds)
      for (int i = 0; i < NX; ++i) judge::bound(error, at.x[k][i], stage.x_lower[i], stage.x_upper[i], at.zx[k][i]);
    else
      judge::raise(error.dual, at.zx[k].template lpNorm<Eigen::Infinity>());
  }
  return error;
}

/// Whether y, z_box, z_g prove that no feasible point exists (Farkas): with multipliers scaled to largest entry 1,
/// |A'y + G'z_g + z_box| <= tolerance, and b'y + support of z negative beyond it.
inline bool proves_infeasible(const SparseQp& qp, const SparseSolution& ray, double tolerance) {
  for (Eigen::Index i = 0; i < qp.lower.size(); ++i)
    if (qp.lower[i] > qp.upper[i]) return true;
  for (Eigen::Index i = 0; i < qp.g_lower.size(); ++i)
    if (qp.g_lower[i] > qp.g_upper[i]) return true;
  double size = 0.0;
  for (const Eigen::VectorXd* part : {&ray.y, &ray.z_box, &ray.z_g})
    for (const double entry : *part) judge::raise(size, std::abs(entry));
  if (!(size > 0.0) || std::isinf(size)) return false;
  const Eigen::VectorXd combined = qp.a_matrix.transpose() * ray.y + qp.g_matrix.transpose() * ray.z_g + ray.z_box;
  double error = 0.0;
  for (const double entry : combined) judge::raise(error, std::abs(entry));
  const double value =
      qp.b.dot(ray.y) + judge::support(ray.z_box, qp.lower, qp.upper) + judge::support(ray.z_g, qp.g_lower, qp.g_upper);
  return error <= tolerance * size && value < -tolerance * size;
}

/// Whether x is a direction along which the objective falls without end: P x = 0, A x = 0, inside the recession cone of
/// the bounds, c'x < 0; each to `tolerance` of the largest entry.
inline bool proves_unbounded(const SparseQp& qp, const SparseSolution& ray, double tolerance) {
  const double size = ray.x.size() > 0 ? ray.x.lpNorm<Eigen::Infinity>() : 0.0;
  if (!(size > 0.0) || std::isinf(size)) return false;
  double error = 0.0;
  for (const double entry : Eigen::VectorXd(judge::hessian_times(qp, ray.x))) judge::raise(error, std::abs(entry));
  for (const double entry : Eigen::VectorXd(qp.a_matrix * ray.x)) judge::raise(error, std::abs(entry));
  const auto cone = [&](const Eigen::VectorXd& v, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      if (std::isfinite(lower[i])) judge::raise(error, -v[i]);
      if (std::isfinite(upper[i])) judge::raise(error, v[i]);
    }
  };
  cone(ray.x, qp.lower, qp.upper);
  cone(qp.g_matrix * ray.x, qp.g_lower, qp.g_upper);
  return error <= tolerance * size && qp.c.dot(ray.x) < -tolerance * size;
}

}  // namespace solenoid::qp
