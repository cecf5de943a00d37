#include "solvers/qp/kkt_error.hpp"

namespace solenoid::qp {
namespace judge {

void raise(double& most, double value) { most = std::isnan(value) ? HUGE_VAL : std::max(most, value); }

namespace {

/// lower <= value <= upper with signed multiplier z.
void bound(KktError& error, double value, double lower, double upper, double z) {
  raise(error.primal, std::max({0.0, lower - value, value - upper}));
  const double pressed_on = z > 0.0 ? upper : lower;
  if (z == 0.0) return;
  if (std::isinf(pressed_on))
    raise(error.dual, std::abs(z));
  else
    raise(error.complementarity, std::abs(z * (value - pressed_on)));
}

Eigen::VectorXd hessian_times(const SparseQp& qp, const Eigen::VectorXd& x) {
  return qp.p_matrix.selfadjointView<Eigen::Upper>() * x;
}

/// A ray's inner product with the bounds it presses on; HUGE_VAL where it presses on none.
double support(const Eigen::VectorXd& z, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
  double total = 0.0;
  for (Eigen::Index i = 0; i < z.size(); ++i)
    if (z[i] != 0.0) total += z[i] * (z[i] > 0.0 ? upper[i] : lower[i]);
  return total;
}

void raise_all(double& most, const Eigen::VectorXd& values) {
  for (const double value : values) raise(most, std::abs(value));
}

}  // namespace

void add_stage(KktError& error, const Stage& s) {
  Eigen::VectorXd state = s.q_matrix * s.x + s.q;
  if (s.u.size() > 0) {
    raise_all(error.primal, s.a * s.x + s.b * s.u + s.c - s.x_next);
    raise_all(error.stationarity, s.r_matrix * s.u + s.s_matrix * s.x + s.r + s.b.transpose() * s.y + s.zu);
    for (Eigen::Index j = 0; j < s.u.size(); ++j) bound(error, s.u[j], s.u_lower[j], s.u_upper[j], s.zu[j]);
    state += s.s_matrix.transpose() * s.u + s.a.transpose() * s.y;
    error.objective += 0.5 * s.u.dot(s.r_matrix * s.u) + s.u.dot(s.s_matrix * s.x + s.r);
  }
  if (s.y_before.size() == 0) return;  // x_0 is a constant; its own share of the cost is not counted
  error.objective += 0.5 * s.x.dot(s.q_matrix * s.x) + s.q.dot(s.x);
  raise_all(error.stationarity, state + s.zx - s.y_before);
  if (!s.state_bounds) return raise_all(error.dual, s.zx);
  for (Eigen::Index i = 0; i < s.x.size(); ++i) bound(error, s.x[i], s.x_lower[i], s.x_upper[i], s.zx[i]);
}

}  // namespace judge

KktError kkt_error(const SparseQp& qp, const SparseSolution& at) {
  KktError error;
  const Eigen::VectorXd curvature = judge::hessian_times(qp, at.x);
  const Eigen::VectorXd gradient =
      curvature + qp.c + qp.a_matrix.transpose() * at.y + qp.g_matrix.transpose() * at.z_g + at.z_box;
  const Eigen::VectorXd defect = qp.a_matrix * at.x - qp.b, rows = qp.g_matrix * at.x;
  judge::raise_all(error.stationarity, gradient);
  judge::raise_all(error.primal, defect);
  for (Eigen::Index i = 0; i < at.x.size(); ++i) judge::bound(error, at.x[i], qp.lower[i], qp.upper[i], at.z_box[i]);
  for (Eigen::Index i = 0; i < rows.size(); ++i) judge::bound(error, rows[i], qp.g_lower[i], qp.g_upper[i], at.z_g[i]);
  error.objective = 0.5 * at.x.dot(curvature) + qp.c.dot(at.x);
  return error;
}

bool proves_infeasible(const SparseQp& qp, const SparseSolution& ray, double tolerance) {
  for (Eigen::Index i = 0; i < qp.lower.size(); ++i)
    if (qp.lower[i] > qp.upper[i]) return true;
  for (Eigen::Index i = 0; i < qp.g_lower.size(); ++i)
    if (qp.g_lower[i] > qp.g_upper[i]) return true;
  double size = 0.0;
  for (const Eigen::VectorXd* part : {&ray.y, &ray.z_box, &ray.z_g}) judge::raise_all(size, *part);
  if (!(size > 0.0) || std::isinf(size)) return false;
  const Eigen::VectorXd combined = qp.a_matrix.transpose() * ray.y + qp.g_matrix.transpose() * ray.z_g + ray.z_box;
  double error = 0.0;
  judge::raise_all(error, combined);
  const double value =
      qp.b.dot(ray.y) + judge::support(ray.z_box, qp.lower, qp.upper) + judge::support(ray.z_g, qp.g_lower, qp.g_upper);
  return error <= tolerance * size && value < -tolerance * size;
}

bool proves_unbounded(const SparseQp& qp, const SparseSolution& ray, double tolerance) {
  const double size = ray.x.size() > 0 ? ray.x.lpNorm<Eigen::Infinity>() : 0.0;
  if (!(size > 0.0) || std::isinf(size)) return false;
  double error = 0.0;
  judge::raise_all(error, judge::hessian_times(qp, ray.x));
  judge::raise_all(error, qp.a_matrix * ray.x);
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
