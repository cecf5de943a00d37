#include "solvers/qp/kkt_error.hpp"
#include "solvers/qp/sparse_solver.hpp"
#include "tests/support/random_qp.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

namespace solenoid::qp {
namespace {

using test::Dice;
using test::random_sparse;

Info solve(const SparseQp& problem, SparseSolution& solution, const Settings& settings = {}) {
  SparseSolver solver;
  solver.setup(problem, settings);
  solution = SparseSolution(problem);
  return solver.solve(problem, solution);
}

void expect_optimal(const SparseQp& problem, const Settings& settings = {}) {
  SparseSolution solution;
  ASSERT_EQ(to_string(solve(problem, solution, settings).status), "optimal");
  EXPECT_LE(kkt_error(problem, solution).largest(), 1e-8);
}

/// Every subset of box sides, dense: the reference that shares no idea with an interior point.
double brute_force_box(const Eigen::MatrixXd& p, const Eigen::VectorXd& c, const Eigen::VectorXd& lower,
                       const Eigen::VectorXd& upper) {
  const int n = static_cast<int>(c.size());
  int combinations = 1;
  for (int i = 0; i < n; ++i) combinations *= 3;
  double best = HUGE_VAL;
  for (int code = 0; code < combinations; ++code) {
    std::vector<int> free;
    Eigen::VectorXd x(n);
    for (int i = 0, rest = code; i < n; ++i, rest /= 3) {
      if (rest % 3 == 0) free.push_back(i);
      x[i] = rest % 3 == 0 ? 0.0 : rest % 3 == 1 ? lower[i] : upper[i];
    }
    const Eigen::VectorXd gradient = p * x + c;
    x(free) -= Eigen::MatrixXd(p(free, free)).ldlt().solve(Eigen::VectorXd(gradient(free)));
    if (((x - lower).array() < -1e-12).any() || ((upper - x).array() < -1e-12).any()) continue;
    best = std::min(best, 0.5 * x.dot(p * x) + c.dot(x));
  }
  return best;
}

TEST(QpSparse, BoxProblemsMatchBruteForceOverActiveSets) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    Dice dice(seed);
    const int n = dice.integer(1, 6);
    const Eigen::MatrixXd root = dice.matrix(n, n),
                          p = root.transpose() * root + 0.05 * Eigen::MatrixXd::Identity(n, n);
    SparseQp problem(n, 0, 0);
    problem.p_matrix = p.sparseView();
    problem.c = 2.0 * dice.vector(n);
    problem.lower = dice.vector(n).array() - 1.0, problem.upper = dice.vector(n).array() + 1.0;
    SparseSolution solution;
    const Info info = solve(problem, solution);
    ASSERT_EQ(info.status, Status::optimal);
    EXPECT_LE(kkt_error(problem, solution).largest(), 1e-8);
    EXPECT_NEAR(info.objective, brute_force_box(p, problem.c, problem.lower, problem.upper), 1e-8);
  }
}

TEST(QpSparse, EqualityProblemsMatchTheDenseKktSystem) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    Dice dice(seed);
    const int n = dice.integer(2, 12), p = dice.integer(1, n - 1);
    const Eigen::MatrixXd root = dice.matrix(n, n), a = dice.matrix(p, n);
    SparseQp problem(n, p, 0);
    const Eigen::MatrixXd hessian = root.transpose() * root + 0.1 * Eigen::MatrixXd::Identity(n, n);
    problem.p_matrix = hessian.sparseView(), problem.a_matrix = a.sparseView();
    problem.c = dice.vector(n), problem.b = dice.vector(p);
    Eigen::MatrixXd kkt = Eigen::MatrixXd::Zero(n + p, n + p);
    kkt << hessian, a.transpose(), a, Eigen::MatrixXd::Zero(p, p);
    Eigen::VectorXd rhs(n + p);
    rhs << -problem.c, problem.b;
    const Eigen::VectorXd expected = kkt.fullPivLu().solve(rhs);
    SparseSolution solution;
    ASSERT_EQ(solve(problem, solution).status, Status::optimal);
    EXPECT_LE((solution.x - expected.head(n)).lpNorm<Eigen::Infinity>(), 1e-6);
    EXPECT_LE(kkt_error(problem, solution).largest(), 1e-8);
  }
}

TEST(QpSparse, RandomRaggedProblems) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE(seed);
    Dice dice(seed);
    const SparseQp problem = random_sparse(dice);
    expect_optimal(problem);
    expect_optimal(problem, {.active_set_steps = 0});
  }
}

TEST(QpSparse, DegenerateProblemsWithFixedVariablesAndWeaklyActiveRows) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    Dice dice(seed);
    expect_optimal(random_sparse(dice, true));
  }
}

TEST(QpSparse, RepeatedEqualitiesAreNoObstacle) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE(seed);
    Dice dice(seed);
    const int n = 6;
    SparseQp problem(n, 4, 0);
    const Eigen::MatrixXd root = dice.matrix(n, n);
    Eigen::MatrixXd a = dice.matrix(4, n);
    a.row(2) = a.row(0), a.row(3) = 2.0 * a.row(1) - a.row(0);
    problem.p_matrix = (root.transpose() * root).eval().sparseView();
    problem.a_matrix = a.sparseView();
    const Eigen::VectorXd x = 0.5 * dice.vector(n);
    problem.b = a * x, problem.c = dice.vector(n);
    problem.lower.setConstant(-1.0), problem.upper.setConstant(1.0);
    expect_optimal(problem);
  }
}

TEST(QpSparse, BadlyScaledProblemsKeepTheirUnits) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    Dice dice(seed);
    SparseQp problem = random_sparse(dice);
    Eigen::VectorXd unit(problem.variables());
    for (double& one : unit) one = std::pow(10.0, dice.integer(-2, 2));
    const Eigen::SparseMatrix<double> scale(unit.asDiagonal());
    problem.p_matrix = (scale * problem.p_matrix * scale).eval();
    problem.a_matrix = (problem.a_matrix * scale).eval(), problem.g_matrix = (problem.g_matrix * scale).eval();
    problem.c = problem.c.cwiseProduct(unit);
    problem.lower = problem.lower.cwiseQuotient(unit), problem.upper = problem.upper.cwiseQuotient(unit);
    SparseSolution solution;
    ASSERT_EQ(to_string(solve(problem, solution).status), "optimal");
    EXPECT_LE(kkt_error(problem, solution).largest(), 1e-8);
  }
}

TEST(QpSparse, SizeOneAndNoVariablesConstrained) {
  SparseQp problem(1, 0, 0);
  problem.p_matrix.insert(0, 0) = 2.0;
  problem.c[0] = -4.0;
  SparseSolution solution;
  ASSERT_EQ(solve(problem, solution).status, Status::optimal);
  EXPECT_NEAR(solution.x[0], 2.0, 1e-9);
  problem.upper[0] = 1.5;
  ASSERT_EQ(solve(problem, solution).status, Status::optimal);
  EXPECT_NEAR(solution.x[0], 1.5, 1e-9);
  EXPECT_NEAR(solution.z_box[0], 1.0, 1e-8);
}

TEST(QpSparse, PermutingTheProblemPermutesTheSolution) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE(seed);
    Dice dice(seed);
    const int n = 8;
    SparseQp problem(n, 2, 3);
    const Eigen::MatrixXd root = dice.matrix(n, n), p = root.transpose() * root + 0.1 * Eigen::MatrixXd::Identity(n, n);
    const Eigen::MatrixXd a = dice.matrix(2, n), g = dice.matrix(3, n);
    problem.p_matrix = p.sparseView(), problem.a_matrix = a.sparseView(), problem.g_matrix = g.sparseView();
    problem.c = 3.0 * dice.vector(n), problem.b.setZero();
    problem.g_lower.setConstant(-0.1), problem.upper.setConstant(0.5), problem.lower.setConstant(-0.5);
    Eigen::PermutationMatrix<Eigen::Dynamic> order(n);
    order.setIdentity();
    for (int i = n - 1; i > 0; --i) order.applyTranspositionOnTheRight(i, dice.integer(0, i));
    SparseQp permuted = problem;
    permuted.p_matrix = Eigen::MatrixXd(order * p * order.transpose()).sparseView();
    permuted.a_matrix = Eigen::MatrixXd(a * order.transpose()).sparseView();
    permuted.g_matrix = Eigen::MatrixXd(g * order.transpose()).sparseView();
    permuted.c = order * problem.c;
    SparseSolution one, other;
    ASSERT_EQ(solve(problem, one).status, Status::optimal);
    ASSERT_EQ(solve(permuted, other).status, Status::optimal);
    EXPECT_LE((order * one.x - other.x).lpNorm<Eigen::Infinity>(), 1e-6);
  }
}

TEST(QpSparse, SetupRefusesShapesThatDoNotFit) {
  SparseQp problem(3, 1, 0);
  problem.a_matrix.resize(1, 2);
  SparseSolver solver;
  EXPECT_THROW(solver.setup(problem), std::invalid_argument);
}

}  // namespace
}  // namespace solenoid::qp
