#include "tests/support/random_qp.hpp"

#include <cmath>

#include <Eigen/Dense>

namespace solenoid::test {

Eigen::MatrixXd Dice::matrix(int rows, int columns, double density) {
  Eigen::MatrixXd out(rows, columns);
  for (double& entry : out.reshaped()) entry = chance(density) ? uniform() : 0.0;
  return out;
}

qp::SparseQp random_sparse(Dice& dice, bool degenerate) {
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

RandomStage random_stage(Dice& dice, const Eigen::VectorXd& x, int inputs, bool state_bounds) {
  const int states = static_cast<int>(x.size());
  RandomStage s;
  s.a = dice.matrix(states, states) * 0.8, s.b = dice.matrix(states, inputs), s.c = 0.1 * dice.vector(states);
  const Eigen::MatrixXd root = dice.matrix(states + inputs, states + inputs, 0.7);
  const Eigen::MatrixXd weight = root.transpose() * root;
  s.q_matrix = weight.topLeftCorner(states, states), s.s_matrix = weight.bottomLeftCorner(inputs, states);
  s.r_matrix = weight.bottomRightCorner(inputs, inputs) + 1e-3 * Eigen::MatrixXd::Identity(inputs, inputs);
  s.q = dice.vector(states), s.r = 3.0 * dice.vector(inputs);
  const Eigen::VectorXd u = dice.vector(inputs);
  const auto unbounded = [](int size) { return Eigen::VectorXd::Constant(size, HUGE_VAL); };
  s.u_lower = -unbounded(inputs), s.u_upper = unbounded(inputs);
  s.x_lower = -unbounded(states), s.x_upper = unbounded(states);
  for (int j = 0; j < inputs; ++j) {
    if (dice.chance(0.8)) s.u_lower[j] = u[j] - dice.uniform(0.0, 1.0);
    if (dice.chance(0.8)) s.u_upper[j] = u[j] + dice.uniform(0.0, 1.0);
    if (dice.chance(0.05)) s.u_lower[j] = s.u_upper[j] = u[j];
  }
  for (int i = 0; state_bounds && i < states; ++i) {
    if (dice.chance(0.5)) s.x_lower[i] = x[i] - dice.uniform(0.0, 0.5);
    if (dice.chance(0.5)) s.x_upper[i] = x[i] + dice.uniform(0.0, 0.5);
  }
  s.x_next = s.a * x + s.b * u + s.c;
  return s;
}

}  // namespace solenoid::test
