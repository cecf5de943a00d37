#pragma once

#include "solvers/qp/ocp_qp.hpp"
#include "solvers/qp/sparse_qp.hpp"

#include <vector>

namespace solenoid::qp {

/// The same problem without its structure: x = (u_0, x_1, u_1, x_2, .., u_{N-1}, x_N), x_0 substituted.
/// The cost of x_0 alone, a constant, is left out, as OcpSolver leaves it out.
template <int NX, int NU>
SparseQp to_sparse(const OcpQp<NX, NU>& ocp) {
  constexpr int block = NX + NU;
  const int stages = ocp.horizon();
  SparseQp qp(stages * block, stages * NX, 0);
  std::vector<Eigen::Triplet<double>> hessian, dynamics;
  const auto u = [](int k) { return k * block; };
  const auto x = [](int k) { return (k - 1) * block + NU; };
  const auto put = [](auto& list, const auto& matrix, int row, int column) {
    for (int i = 0; i < matrix.rows(); ++i)
      for (int j = 0; j < matrix.cols(); ++j) list.emplace_back(row + i, column + j, matrix(i, j));
  };
  for (int k = 0; k <= stages; ++k) {
    const auto& stage = ocp.stages[static_cast<std::size_t>(k)];
    if (k > 0) {
      put(hessian, stage.q_matrix, x(k), x(k));
      qp.c.template segment<NX>(x(k)) = stage.q;
      if (ocp.state_bounds) {
        qp.lower.template segment<NX>(x(k)) = stage.x_lower;
        qp.upper.template segment<NX>(x(k)) = stage.x_upper;
      }
    }
    if (k == stages) break;
    put(hessian, stage.r_matrix, u(k), u(k));
    qp.c.template segment<NU>(u(k)) = stage.r;
    qp.lower.template segment<NU>(u(k)) = stage.u_lower;
    qp.upper.template segment<NU>(u(k)) = stage.u_upper;
    put(dynamics, stage.b, k * NX, u(k));
    put(dynamics, Eigen::Matrix<double, NX, NX>(-Eigen::Matrix<double, NX, NX>::Identity()), k * NX, x(k + 1));
    qp.b.template segment<NX>(k * NX) = -stage.c;
    if (k == 0) {
      qp.c.template segment<NU>(0) += stage.s_matrix * ocp.x0;
      qp.b.template segment<NX>(0) -= stage.a * ocp.x0;
    } else {
      put(dynamics, stage.a, k * NX, x(k));
      put(hessian, stage.s_matrix, u(k), x(k));
      put(hessian, Eigen::Matrix<double, NX, NU>(stage.s_matrix.transpose()), x(k), u(k));
    }
  }
  const auto drop_zeros = [](const auto& entry) { return entry.value() != 0.0 || entry.row() == entry.col(); };
  std::erase_if(hessian, [&](const auto& entry) { return !drop_zeros(entry); });
  std::erase_if(dynamics, [](const auto& entry) { return entry.value() == 0.0; });
  qp.p_matrix.setFromTriplets(hessian.begin(), hessian.end());
  qp.a_matrix.setFromTriplets(dynamics.begin(), dynamics.end());
  return qp;
}

}  // namespace solenoid::qp
