#pragma once

#include "solvers/qp/ocp_qp.hpp"
#include "solvers/qp/sparse_qp.hpp"

#include <random>

#include <Eigen/Dense>

namespace solenoid::test {

/// Seeded numbers for ragged problems.
class Dice {
 public:
  explicit Dice(unsigned seed) : engine_(seed) {}
  double uniform(double from = -1.0, double to = 1.0) { return std::uniform_real_distribution<>(from, to)(engine_); }
  int integer(int from, int to) { return std::uniform_int_distribution<>(from, to)(engine_); }
  bool chance(double probability) { return uniform(0.0, 1.0) < probability; }
  Eigen::MatrixXd matrix(int rows, int columns, double density = 1.0) {
    Eigen::MatrixXd out(rows, columns);
    for (double& entry : out.reshaped()) entry = chance(density) ? uniform() : 0.0;
    return out;
  }
  Eigen::VectorXd vector(int size) { return matrix(size, 1); }

 private:
  std::mt19937 engine_;
};

/// A problem of random shape with an optimum and, beside its equalities, an interior, both by construction: P of any
/// rank, rows dense or sparse, bounds missing here and there. `degenerate` adds fixed variables, rows with equal bounds
/// and active bounds without multiplier.
inline qp::SparseQp random_sparse(Dice& dice, bool degenerate = false) {
  const int n = dice.integer(1, 14), p = dice.integer(0, n / 2), m = dice.integer(0, 10);
  qp::SparseQp qp(n, p, m);
  const Eigen::MatrixXd root = dice.matrix(dice.integer(0, n), n, 0.5);
  const Eigen::MatrixXd a = dice.matrix(p, n, 0.6), g = dice.matrix(m, n, 0.5);
  const Eigen::VectorXd x = dice.vector(n);
  qp.p_matrix = (root.transpose() * root).sparseView();
  qp.a_matrix = a.sparseView(), qp.g_matrix = g.sparseView();
  qp.b = a * x;

  // Rows held equal, and a direction inside the others: a bound may be active at x only where it leads away from it.
  Eigen::MatrixXd all(n + m, n);
  all << Eigen::MatrixXd::Identity(n, n), g;
  Eigen::VectorXi fixed(n + m);
  Eigen::MatrixXd held = Eigen::MatrixXd::Zero(p + n + m, n);
  held.topRows(p) = a;
  for (int i = 0; i < n + m; ++i) {
    fixed[i] = degenerate && dice.chance(0.12);
    if (fixed[i]) held.row(p + i) = all.row(i);
  }
  const Eigen::VectorXd wish = dice.vector(n);
  const Eigen::VectorXd inward = wish - held.completeOrthogonalDecomposition().solve(held * wish);

  // Dual feasible by construction: c = -(P x + A'y + C'z) with multipliers pressing on active bounds only.
  qp.c = -(root.transpose() * (root * x) + a.transpose() * dice.vector(p));
  for (int i = 0; i < n + m; ++i) {
    const double value = all.row(i) * x, away = 0.05 * all.row(i).dot(inward);
    double& lower = i < n ? qp.lower[i] : qp.g_lower[i - n];
    double& upper = i < n ? qp.upper[i] : qp.g_upper[i - n];
    const bool active = away > 0.01 && dice.chance(0.5);
    if (fixed[i]) {
      lower = upper = value;
    } else {
      if (active || dice.chance(0.5)) lower = value - (active ? 0.0 : dice.uniform(0.5, 2.0));
      if (dice.chance(0.6)) upper = value + dice.uniform(0.5, 2.0);
    }
    const bool pressed = active && !(degenerate && dice.chance(0.5));
    if (pressed) qp.c += dice.uniform(0.1, 1.0) * all.row(i).transpose();
  }
  return qp;
}

template <int NX, int NU>
qp::OcpQp<NX, NU> random_ocp(Dice& dice, int horizon, bool state_bounds) {
  qp::OcpQp<NX, NU> qp(horizon, state_bounds);
  qp.x0 = dice.vector(NX);
  Eigen::Matrix<double, NX, 1> x = qp.x0;
  for (int k = 0; k <= horizon; ++k) {
    auto& stage = qp.stages[static_cast<std::size_t>(k)];
    stage.a = dice.matrix(NX, NX) * 0.8, stage.b = dice.matrix(NX, NU), stage.c = 0.1 * dice.vector(NX);
    const Eigen::MatrixXd root = dice.matrix(NX + NU, NX + NU, 0.7);
    const Eigen::MatrixXd weight = root.transpose() * root;
    stage.q_matrix = weight.topLeftCorner(NX, NX), stage.s_matrix = weight.bottomLeftCorner(NU, NX);
    stage.r_matrix = weight.bottomRightCorner(NU, NU) + 1e-3 * Eigen::MatrixXd::Identity(NU, NU);
    stage.q = dice.vector(NX), stage.r = 3.0 * dice.vector(NU);
    const Eigen::VectorXd u = dice.vector(NU);
    for (int j = 0; j < NU; ++j) {
      if (dice.chance(0.8)) stage.u_lower[j] = u[j] - dice.uniform(0.0, 1.0);
      if (dice.chance(0.8)) stage.u_upper[j] = u[j] + dice.uniform(0.0, 1.0);
      if (dice.chance(0.05)) stage.u_lower[j] = stage.u_upper[j] = u[j];
    }
    if (k > 0 && state_bounds)
      for (int i = 0; i < NX; ++i) {
        if (dice.chance(0.5)) stage.x_lower[i] = x[i] - dice.uniform(0.0, 0.5);
        if (dice.chance(0.5)) stage.x_upper[i] = x[i] + dice.uniform(0.0, 0.5);
      }
    x = stage.a * x + stage.b * u + stage.c;
  }
  return qp;
}

}  // namespace solenoid::test
