#pragma once

#include <limits>

#include <Eigen/SparseCore>

namespace solenoid::qp {

/// Convex QP of any structure.
///
///   minimise x'P x / 2 + c'x   subject to  A x = b,  g_lower <= G x <= g_upper,  lower <= x <= upper
///
/// shapes   P: n x n, positive semidefinite, upper triangle read (a full symmetric matrix is fine); A: p x n; G: m x n
/// note     infinite bounds are absent; lower = upper fixes a variable; lower > upper makes the problem infeasible
struct SparseQp {
  using Matrix = Eigen::SparseMatrix<double>;
  static constexpr double infinity = std::numeric_limits<double>::infinity();

  SparseQp() = default;
  SparseQp(int n, int p, int m)
      : p_matrix(n, n),
        a_matrix(p, n),
        g_matrix(m, n),
        c(Eigen::VectorXd::Zero(n)),
        b(Eigen::VectorXd::Zero(p)),
        g_lower(Eigen::VectorXd::Constant(m, -infinity)),
        g_upper(Eigen::VectorXd::Constant(m, infinity)),
        lower(Eigen::VectorXd::Constant(n, -infinity)),
        upper(Eigen::VectorXd::Constant(n, infinity)) {}

  int variables() const { return static_cast<int>(c.size()); }
  int equalities() const { return static_cast<int>(b.size()); }
  int inequalities() const { return static_cast<int>(g_lower.size()); }

  Matrix p_matrix, a_matrix, g_matrix;
  Eigen::VectorXd c, b, g_lower, g_upper, lower, upper;
};

/// Primal and dual solution, or a certificate where the status says so.
///
/// shapes   x: n, y: p, z_box: n, z_g: m       stationarity  P x + c + A'y + G'z_g + z_box = 0
/// signs    z positive where the upper bound presses, negative where the lower does
struct SparseSolution {
  SparseSolution() = default;
  explicit SparseSolution(const SparseQp& problem)
      : x(Eigen::VectorXd::Zero(problem.variables())),
        y(Eigen::VectorXd::Zero(problem.equalities())),
        z_box(Eigen::VectorXd::Zero(problem.variables())),
        z_g(Eigen::VectorXd::Zero(problem.inequalities())) {}

  Eigen::VectorXd x, y, z_box, z_g;
};

}  // namespace solenoid::qp
