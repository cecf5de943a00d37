#pragma once

#include "solvers/qp/ocp_qp.hpp"
#include "solvers/qp/sparse_qp.hpp"

#include <algorithm>
#include <random>

namespace solenoid::test {

/// Seeded numbers for ragged problems.
class Dice {
 public:
  explicit Dice(unsigned seed) : engine_(seed) {}
  double uniform(double from = -1.0, double to = 1.0) { return std::uniform_real_distribution<>(from, to)(engine_); }
  int integer(int from, int to) { return std::uniform_int_distribution<>(from, to)(engine_); }
  bool chance(double probability) { return uniform(0.0, 1.0) < probability; }
  Eigen::MatrixXd matrix(int rows, int columns, double density = 1.0);
  Eigen::VectorXd vector(int size) { return matrix(size, 1); }

 private:
  std::mt19937 engine_;
};

/// A problem of random shape with an optimum and, beside its equalities, an interior, both by construction: P of any
/// rank, rows dense or sparse, bounds missing here and there. `degenerate` adds fixed variables, rows with equal bounds
/// and active bounds without multiplier.
qp::SparseQp random_sparse(Dice& dice, bool degenerate = false);

/// A stage of any size whose bounds x and some u keep; x_next is where that u leads.
struct RandomStage {
  Eigen::MatrixXd a, b, q_matrix, r_matrix, s_matrix;
  Eigen::VectorXd c, q, r, u_lower, u_upper, x_lower, x_upper, x_next;
};
RandomStage random_stage(Dice& dice, const Eigen::VectorXd& x, int inputs, bool state_bounds);

/// A feasible problem: such stages in a row.
template <int NX, int NU>
qp::OcpQp<NX, NU> random_ocp(Dice& dice, int horizon, bool state_bounds) {
  qp::OcpQp<NX, NU> qp(horizon, state_bounds);
  qp.x0 = dice.vector(NX);
  Eigen::VectorXd x = qp.x0;
  for (int k = 0; k <= horizon; ++k) {
    const RandomStage s = random_stage(dice, x, NU, k > 0 && state_bounds);
    auto& stage = qp.stages[static_cast<std::size_t>(k)];
    const auto copy = [](auto& to, const auto& from) { std::copy_n(from.data(), from.size(), to.data()); };
    copy(stage.a, s.a), copy(stage.b, s.b), copy(stage.c, s.c);
    copy(stage.q_matrix, s.q_matrix), copy(stage.r_matrix, s.r_matrix), copy(stage.s_matrix, s.s_matrix);
    copy(stage.q, s.q), copy(stage.r, s.r);
    copy(stage.u_lower, s.u_lower), copy(stage.u_upper, s.u_upper);
    copy(stage.x_lower, s.x_lower), copy(stage.x_upper, s.x_upper);
    x = s.x_next;
  }
  return qp;
}

}  // namespace solenoid::test
