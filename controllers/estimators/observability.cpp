#include "controllers/estimators/observability.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace solenoid {
namespace {

/// An orthonormal basis of the kernel: of the directions with singular values at most `none`.
Eigen::MatrixXd kernel(const Eigen::MatrixXd& matrix, double none) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeFullV);
  Eigen::Index rank = 0;
  while (rank < svd.singularValues().size() && svd.singularValues()[rank] > none) ++rank;
  return svd.matrixV().rightCols(matrix.cols() - rank);
}

}  // namespace

Observability observability(const Eigen::MatrixXd& a, const Eigen::MatrixXd& c, double dt) {
  const Eigen::Index n = a.rows();
  const Eigen::MatrixXd rate = (a - Eigen::MatrixXd::Identity(n, n)) / dt;
  constexpr double relative = 1e-9;
  Eigen::MatrixXd hidden = kernel(c, relative * std::max(c.norm(), 1e-300));
  for (Eigen::Index before = n + 1; hidden.cols() > 0 && hidden.cols() < before;) {
    before = hidden.cols();
    const Eigen::MatrixXd moved = rate * hidden;
    const Eigen::MatrixXd leaving = moved - hidden * (hidden.transpose() * moved);
    hidden = (hidden * kernel(leaving, relative * rate.norm())).eval();
  }
  Observability found{static_cast<int>(n), static_cast<int>(n - hidden.cols()), 0.0};
  if (hidden.cols() > 0) {
    const Eigen::MatrixXd inside = hidden.transpose() * a * hidden;
    found.persisting = inside.eigenvalues().cwiseAbs().maxCoeff();
  }
  return found;
}

}  // namespace solenoid
