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

/// The residuals of a sparse QP's solution, from the problem's own data.
KktError kkt_error(const SparseQp& qp, const SparseSolution& at);

namespace judge {

using Matrix = Eigen::Map<const Eigen::MatrixXd>;
using Vector = Eigen::Map<const Eigen::VectorXd>;

/// One stage of any size, with its part of the solution.
struct Stage {
  Matrix a, b, q_matrix, r_matrix, s_matrix;
  Vector c, q, r, u_lower, u_upper, x_lower, x_upper;
  Vector x, zx;
  Vector y_before;          ///< of the dynamics that lead to x; nothing at the first stage
  Vector u, zu, x_next, y;  ///< nothing at the last stage
  bool state_bounds;
};
void raise(double& most, double value);
void add_stage(KktError& error, const Stage& stage);

}  // namespace judge

/// Straight from the stage form; shares nothing with the solver's packed layout or with to_sparse.
template <int NX, int NU>
KktError kkt_error(const OcpQp<NX, NU>& qp, const OcpSolution<NX, NU>& at) {
  const auto matrix = [](const auto& m) { return judge::Matrix(m.data(), m.rows(), m.cols()); };
  const auto vector = [](const auto& v) { return judge::Vector(v.data(), v.size()); };
  const auto entry = [&](const auto& list, std::size_t k) {
    return k < list.size() ? vector(list[k]) : judge::Vector(nullptr, 0);
  };
  KktError error;
  for (int i = 0; i < NX; ++i) judge::raise(error.primal, std::abs(at.x[0][i] - qp.x0[i]));
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    const auto& s = qp.stages[k];
    judge::add_stage(error, {.a = matrix(s.a),
                             .b = matrix(s.b),
                             .q_matrix = matrix(s.q_matrix),
                             .r_matrix = matrix(s.r_matrix),
                             .s_matrix = matrix(s.s_matrix),
                             .c = vector(s.c),
                             .q = vector(s.q),
                             .r = vector(s.r),
                             .u_lower = vector(s.u_lower),
                             .u_upper = vector(s.u_upper),
                             .x_lower = vector(s.x_lower),
                             .x_upper = vector(s.x_upper),
                             .x = entry(at.x, k),
                             .zx = entry(at.zx, k),
                             .y_before = entry(at.y, k - 1),
                             .u = entry(at.u, k),
                             .zu = entry(at.zu, k),
                             .x_next = entry(at.x, k + 1),
                             .y = entry(at.y, k),
                             .state_bounds = qp.state_bounds});
  }
  return error;
}

/// Whether y, z_box, z_g prove that no feasible point exists (Farkas): with multipliers scaled to largest entry 1,
/// |A'y + G'z_g + z_box| <= tolerance, and b'y + support of z negative beyond it.
bool proves_infeasible(const SparseQp& qp, const SparseSolution& ray, double tolerance);

/// Whether x is a direction along which the objective falls without end: P x = 0, A x = 0, inside the recession cone of
/// the bounds, c'x < 0; each to `tolerance` of the largest entry.
bool proves_unbounded(const SparseQp& qp, const SparseSolution& ray, double tolerance);

}  // namespace solenoid::qp
