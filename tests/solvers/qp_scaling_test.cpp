// Units that differ by up to 10^6 in variables, rows and cost: the same problem, the same optimum.
#include "solvers/qp/kkt_error.hpp"
#include "solvers/qp/ocp_solver.hpp"
#include "solvers/qp/sparse_solver.hpp"
#include "tests/support/random_qp.hpp"

#include <gtest/gtest.h>

namespace solenoid::qp {
namespace {

constexpr int decades = 3;

Eigen::VectorXd random_units(test::Dice& dice, Eigen::Index size) {
  Eigen::VectorXd units(size);
  for (double& unit : units) unit = std::pow(10.0, dice.uniform(-decades, decades));
  return units;
}

SparseQp::Matrix in_units(const Eigen::VectorXd& rows, const SparseQp::Matrix& matrix, const Eigen::VectorXd& columns) {
  return Eigen::MatrixXd(rows.asDiagonal() * Eigen::MatrixXd(matrix) * columns.asDiagonal()).sparseView(0.0, 0.0);
}

/// The problem for x / unit, its rows and its cost multiplied.
SparseQp in_other_units(const SparseQp& problem, const Eigen::VectorXd& unit, const Eigen::VectorXd& equality,
                        const Eigen::VectorXd& row, double cost) {
  SparseQp other = problem;
  other.p_matrix = in_units(cost * unit, problem.p_matrix, unit);
  other.a_matrix = in_units(equality, problem.a_matrix, unit);
  other.g_matrix = in_units(row, problem.g_matrix, unit);
  other.b = problem.b.cwiseProduct(equality), other.c = cost * problem.c.cwiseProduct(unit);
  other.lower = problem.lower.cwiseQuotient(unit), other.upper = problem.upper.cwiseQuotient(unit);
  other.g_lower = problem.g_lower.cwiseProduct(row), other.g_upper = problem.g_upper.cwiseProduct(row);
  return other;
}

// Tolerances are absolute, in the problem's units: one that doubles can hold grows with its numbers.
Settings tolerant(double largest_gradient, int active_set_steps) {
  Settings settings;
  settings.tolerance *= std::max(1.0, largest_gradient);
  settings.active_set_steps = active_set_steps;
  return settings;
}

TEST(QpScaling, SparseProblemsDoNotStall) {
  for (const bool degenerate : {false, true})
    for (unsigned seed = 0; seed < 300; ++seed) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << " degenerate " << degenerate);
      test::Dice dice(seed);
      const SparseQp problem = test::random_sparse(dice, degenerate);
      const Eigen::VectorXd unit = random_units(dice, problem.variables()),
                            equality = random_units(dice, problem.equalities()),
                            row = random_units(dice, problem.inequalities());
      const double cost = random_units(dice, 1)[0];
      SparseSolver solver;
      SparseSolution solution(problem);
      solver.setup(problem);
      const Info plain = solver.solve(problem, solution);
      ASSERT_EQ(to_string(plain.status), "optimal");

      const SparseQp other = in_other_units(problem, unit, equality, row, cost);
      const Settings settings = tolerant(other.c.lpNorm<Eigen::Infinity>(), Settings{}.active_set_steps);
      solver.setup(other, settings);
      const Info info = solver.solve(other, solution);
      EXPECT_EQ(to_string(info.status), "optimal");
      EXPECT_LE(kkt_error(other, solution).largest(), 2.0 * settings.tolerance);
      EXPECT_NEAR(info.objective / cost, plain.objective, 1e-5 * (1.0 + std::abs(plain.objective)));
      EXPECT_LT(info.iterations, 60);
    }
}

OcpQp<4, 3> in_other_units(const OcpQp<4, 3>& problem, const Eigen::VectorXd& state, const Eigen::VectorXd& input,
                           double cost) {
  OcpQp<4, 3> other = problem;
  const Eigen::Vector4d x = state, per_x = state.cwiseInverse();
  const Eigen::Vector3d u = input;
  other.x0 = problem.x0.cwiseQuotient(x);
  for (auto& stage : other.stages) {
    stage.a = (per_x.asDiagonal() * stage.a * x.asDiagonal()).eval();
    stage.b = (per_x.asDiagonal() * stage.b * u.asDiagonal()).eval();
    stage.c = stage.c.cwiseQuotient(x).eval();
    stage.q_matrix = (cost * (x.asDiagonal() * stage.q_matrix * x.asDiagonal())).eval();
    stage.r_matrix = (cost * (u.asDiagonal() * stage.r_matrix * u.asDiagonal())).eval();
    stage.s_matrix = (cost * (u.asDiagonal() * stage.s_matrix * x.asDiagonal())).eval();
    stage.q = (cost * stage.q.cwiseProduct(x)).eval(), stage.r = (cost * stage.r.cwiseProduct(u)).eval();
    stage.u_lower = stage.u_lower.cwiseQuotient(u).eval(), stage.u_upper = stage.u_upper.cwiseQuotient(u).eval();
    stage.x_lower = stage.x_lower.cwiseQuotient(x).eval(), stage.x_upper = stage.x_upper.cwiseQuotient(x).eval();
  }
  return other;
}

TEST(QpScaling, StagedProblemsDoNotStall) {
  for (const bool state_bounds : {false, true})
    for (unsigned seed = 0; seed < 300; ++seed) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << " state bounds " << state_bounds);
      test::Dice dice(seed);
      const OcpQp<4, 3> problem = test::random_ocp<4, 3>(dice, dice.integer(1, 12), state_bounds);
      const double cost = random_units(dice, 1)[0];
      const OcpQp<4, 3> other = in_other_units(problem, random_units(dice, 4), random_units(dice, 3), cost);
      double gradient = 0.0;
      for (const auto& stage : other.stages)
        gradient = std::max({gradient, stage.q.lpNorm<Eigen::Infinity>(), stage.r.lpNorm<Eigen::Infinity>()});
      OcpSolution<4, 3> solution(problem.horizon());
      OcpSolver<4, 3> solver;
      solver.setup(problem);
      const Info plain = solver.solve(problem, solution);
      ASSERT_EQ(to_string(plain.status), "optimal");
      for (const int active_set_steps : {0, Settings{}.active_set_steps}) {
        const Settings settings = tolerant(gradient, active_set_steps);
        solver.setup(other, settings);
        const Info info = solver.solve(other, solution);
        EXPECT_EQ(to_string(info.status), "optimal");
        EXPECT_LE(kkt_error(other, solution).largest(), 2.0 * settings.tolerance);
        EXPECT_LT(info.iterations, 60);
      }
    }
}

/// Inputs whose cost bends less than the proximal shift would by itself.
TEST(QpScaling, CheapInputsAreFound) {
  for (const bool state_bounds : {false, true})
    for (unsigned seed = 0; seed < 100; ++seed) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << " state bounds " << state_bounds);
      test::Dice dice(seed);
      const OcpQp<4, 3> problem = test::random_ocp<4, 3>(dice, dice.integer(1, 12), state_bounds);
      const double cost = 1e-3;
      const OcpQp<4, 3> other =
          in_other_units(problem, Eigen::VectorXd::Ones(4), Eigen::VectorXd::Constant(3, 1e-4), cost);
      for (const int active_set_steps : {0, Settings{}.active_set_steps}) {
        OcpSolution<4, 3> solution(problem.horizon());
        OcpSolver<4, 3> solver;
        solver.setup(problem);
        const Info plain = solver.solve(problem, solution);
        solver.setup(other, {.active_set_steps = active_set_steps});
        const Info info = solver.solve(other, solution);
        EXPECT_EQ(to_string(info.status), "optimal");
        EXPECT_LE(kkt_error(other, solution).largest(), 1e-8);
        EXPECT_LT(info.iterations, 60);
        EXPECT_NEAR(info.objective / cost, plain.objective, 1e-5 * (1.0 + std::abs(plain.objective)));
      }
    }
}

}  // namespace
}  // namespace solenoid::qp
