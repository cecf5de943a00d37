// One test a status: what provokes it, and what the solution then holds.
#include "solvers/qp/kkt_error.hpp"
#include "solvers/qp/ocp_solver.hpp"
#include "solvers/qp/ocp_to_sparse.hpp"
#include "solvers/qp/sparse_solver.hpp"
#include "tests/support/random_qp.hpp"

#include <gtest/gtest.h>

namespace solenoid::qp {
namespace {

SparseQp two_variables() {
  SparseQp problem(2, 1, 1);
  problem.p_matrix.insert(0, 0) = 1.0;
  problem.p_matrix.insert(1, 1) = 1.0;
  problem.a_matrix.insert(0, 0) = problem.a_matrix.insert(0, 1) = 1.0;
  problem.g_matrix.insert(0, 0) = 1.0;
  problem.b[0] = 1.0;
  problem.c << 1.0, -2.0;
  problem.g_lower[0] = 0.0;
  problem.lower.setConstant(-5.0), problem.upper.setConstant(0.9);
  return problem;
}

struct Outcome {
  Info info;
  SparseSolution solution;
};

Outcome run(const SparseQp& problem, const Settings& settings = {}, Deadline deadline = Deadline::never()) {
  SparseSolver solver;
  solver.setup(problem, settings);
  Outcome outcome{{}, SparseSolution(problem)};
  outcome.info = solver.solve(problem, outcome.solution, Start::cold, deadline);
  return outcome;
}

TEST(QpStatus, Optimal) {
  const SparseQp problem = two_variables();
  const Outcome outcome = run(problem);
  EXPECT_EQ(outcome.info.status, Status::optimal);
  EXPECT_LE(kkt_error(problem, outcome.solution).largest(), 1e-8);
  EXPECT_NEAR(outcome.solution.x[0], 0.1, 1e-8);
  EXPECT_NEAR(outcome.solution.x[1], 0.9, 1e-8);
}

TEST(QpStatus, IterationLimit) {
  const Outcome outcome = run(two_variables(), {.max_iterations = 2, .active_set_steps = 0});
  EXPECT_EQ(outcome.info.status, Status::iteration_limit);
  EXPECT_EQ(outcome.info.iterations, 2);
  EXPECT_TRUE(outcome.solution.x.allFinite());
}

TEST(QpStatus, DeadlineReached) {
  const Outcome outcome = run(two_variables(), {}, Deadline::after(std::chrono::nanoseconds(0)));
  EXPECT_EQ(outcome.info.status, Status::deadline_reached);
  EXPECT_TRUE(outcome.solution.x.allFinite());
}

TEST(QpStatus, PrimalInfeasibleByRows) {
  SparseQp problem = two_variables();
  problem.g_lower[0] = 0.8, problem.lower[1] = 0.5;  // x0 + x1 = 1 cannot be
  const Outcome outcome = run(problem);
  EXPECT_EQ(to_string(outcome.info.status), "primal_infeasible");
  EXPECT_TRUE(proves_infeasible(problem, outcome.solution, 1e-6));
}

TEST(QpStatus, PrimalInfeasibleByContradictoryEqualities) {
  SparseQp problem(2, 2, 0);
  problem.p_matrix.setIdentity();
  for (const int row : {0, 1})
    for (const int column : {0, 1}) problem.a_matrix.insert(row, column) = 1.0;
  problem.b << 1.0, 2.0;
  const Outcome outcome = run(problem);
  EXPECT_EQ(to_string(outcome.info.status), "primal_infeasible");
  EXPECT_TRUE(proves_infeasible(problem, outcome.solution, 1e-6));
}

TEST(QpStatus, PrimalInfeasibleByCrossedBounds) {
  SparseQp problem = two_variables();
  problem.lower[0] = 0.5, problem.upper[0] = 0.4;
  EXPECT_EQ(run(problem).info.status, Status::primal_infeasible);
}

/// Limits that miss each other by little are infeasible all the same, and one point is feasible (osqp/osqp#485, #256).
TEST(QpStatus, AGapHoweverNarrowIsTold) {
  for (const double gap : {1e-2, 1e-4, 1e-6, 3e-7, 0.0}) {
    SCOPED_TRACE(gap);
    SparseQp problem(1, 0, 2);  // minimise x  s.t.  x <= 0, x >= gap
    problem.c[0] = 1.0;
    problem.g_matrix.insert(0, 0) = problem.g_matrix.insert(1, 0) = 1.0;
    problem.g_lower << -HUGE_VAL, gap;
    problem.g_upper << 0.0, HUGE_VAL;
    const Outcome outcome = run(problem);
    EXPECT_EQ(to_string(outcome.info.status), gap > 0 ? "primal_infeasible" : "optimal");
    EXPECT_EQ(proves_infeasible(problem, outcome.solution, 1e-7), gap > 0);
  }
}

/// x_1 = u within limits on u and x_1 that meet in `meet` or miss each other by `gap`.
OcpQp<1, 1> one_step(double meet, double gap) {
  OcpQp<1, 1> problem(1, true);
  problem.stages[0].b(0, 0) = problem.stages[0].r_matrix(0, 0) = 1.0;
  problem.stages[0].r[0] = -4.0;
  problem.stages[0].u_lower[0] = meet + gap;
  problem.stages[1].x_upper[0] = meet;
  return problem;
}

TEST(QpStatus, AGapBetweenInputAndStateIsTold) {
  for (const double meet : {0.0, 0.5, 10.0})
    for (const double gap : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 0.0}) {
      SCOPED_TRACE(testing::Message() << "limits of " << meet << " and a gap of " << gap);
      const OcpQp<1, 1> problem = one_step(meet, gap);
      OcpSolver<1, 1> solver;
      solver.setup(problem);
      OcpSolution<1, 1> solution(1);
      const Info info = solver.solve(problem, solution);
      EXPECT_EQ(to_string(info.status), gap > 0.0 ? "primal_infeasible" : "optimal");
      const SparseQp flat = to_sparse(problem);
      SparseSolution ray(flat);
      ray.y << solution.y[0];
      ray.z_box << solution.zu[0], solution.zx[1];
      EXPECT_EQ(proves_infeasible(flat, ray, 1e-7), gap > 0.0);
      if (gap == 0.0) {
        EXPECT_LE(kkt_error(problem, solution).largest(), 1e-7);
        EXPECT_NEAR(solution.u[0][0], meet, 1e-7);
      }
    }
}

TEST(QpStatus, AGapBetweenSumsFarFromTheOriginIsTold) {
  for (const double gap : {1e-2, 1e-3, 1e-4}) {
    SCOPED_TRACE(gap);
    SparseQp problem(2, 0, 2);
    problem.p_matrix.setIdentity();
    for (const int row : {0, 1})
      for (const int column : {0, 1}) problem.g_matrix.insert(row, column) = 1.0;
    problem.g_lower << -HUGE_VAL, 1000.0 + gap;
    problem.g_upper << 1000.0, HUGE_VAL;
    const Outcome outcome = run(problem);
    EXPECT_EQ(to_string(outcome.info.status), "primal_infeasible");
    EXPECT_TRUE(proves_infeasible(problem, outcome.solution, 1e-7));
  }
}

/// A feasible set of one point, (0.5, 0.5), however flat its certificate of the opposite looks (osqp/osqp#485, #255, #2).
TEST(QpStatus, AFeasibleSetOfOnePointIsFeasible) {
  for (const bool as_rows : {false, true})
    for (const bool curved : {false, true}) {
      SCOPED_TRACE(testing::Message() << "rows " << as_rows << " curved " << curved);
      SparseQp problem(2, 0, as_rows ? 3 : 1);
      if (curved) problem.p_matrix.insert(0, 0) = problem.p_matrix.insert(1, 1) = 2.0;
      problem.c << -4.0, 2.0;
      problem.g_matrix.insert(0, 0) = problem.g_matrix.insert(0, 1) = 1.0;
      problem.g_upper[0] = 1.0;
      if (as_rows) {
        problem.g_matrix.insert(1, 0) = problem.g_matrix.insert(2, 1) = 1.0;
        problem.g_lower.tail<2>().setConstant(0.5);
      } else {
        problem.lower.setConstant(0.5);
      }
      const Outcome outcome = run(problem);
      EXPECT_EQ(to_string(outcome.info.status), "optimal");
      EXPECT_NEAR(outcome.info.objective, curved ? -0.5 : -1.0, 1e-6);
      EXPECT_LE(kkt_error(problem, outcome.solution).largest(), 1e-7);
    }
}

TEST(QpStatus, EqualitiesWithoutACostOrWithoutRoomHaveTheirSolution) {
  SparseQp free(3, 2, 0);
  free.a_matrix.insert(0, 0) = free.a_matrix.insert(0, 1) = 1.0;
  free.a_matrix.insert(1, 1) = free.a_matrix.insert(1, 2) = 1.0;
  free.b << 2.0, 3.0;
  const Outcome any = run(free);
  EXPECT_EQ(to_string(any.info.status), "optimal");
  EXPECT_LE(kkt_error(free, any.solution).largest(), 1e-7);

  SparseQp simplex(3, 1, 0);  // shrunk to a point by its own bounds
  simplex.p_matrix.setIdentity();
  for (const int column : {0, 1, 2}) simplex.a_matrix.insert(0, column) = 1.0;
  simplex.b[0] = 0.3;
  simplex.lower.setConstant(0.1), simplex.upper.setConstant(1.0);
  const Outcome point = run(simplex);
  EXPECT_EQ(to_string(point.info.status), "optimal");
  EXPECT_NEAR(point.info.objective, 0.015, 1e-7);
  EXPECT_LE(kkt_error(simplex, point.solution).largest(), 1e-7);
}

TEST(QpStatus, DualInfeasible) {
  SparseQp problem = two_variables();
  problem.p_matrix.coeffRef(0, 0) = 0.0, problem.p_matrix.coeffRef(1, 1) = 0.0;
  problem.upper.setConstant(HUGE_VAL), problem.lower.setConstant(-HUGE_VAL);  // down along (1, -1) or up: c'd = 3
  problem.g_lower[0] = -HUGE_VAL;
  const Outcome outcome = run(problem);
  EXPECT_EQ(to_string(outcome.info.status), "dual_infeasible");
  EXPECT_TRUE(proves_unbounded(problem, outcome.solution, 1e-6));
}

TEST(QpStatus, RandomInfeasibleProblemsCarryProofs) {
  int seen = 0;
  for (unsigned seed = 0; seed < 80; ++seed) {
    SCOPED_TRACE(seed);
    test::Dice dice(seed);
    SparseQp problem = test::random_sparse(dice);
    if (problem.inequalities() < 2) continue;
    ++seen;
    // Row 1 becomes the opposite of row 0, and both are asked to be large.
    Eigen::MatrixXd g = problem.g_matrix;
    g.row(0) += Eigen::RowVectorXd::Constant(problem.variables(), 0.1);
    g.row(1) = -g.row(0);
    problem.g_matrix = g.sparseView();
    problem.g_lower.head<2>().setConstant(1.0), problem.g_upper.head<2>().setConstant(HUGE_VAL);
    const Outcome outcome = run(problem);
    EXPECT_EQ(to_string(outcome.info.status), "primal_infeasible");
    EXPECT_TRUE(proves_infeasible(problem, outcome.solution, 1e-6));
  }
  EXPECT_GT(seen, 40);
}

TEST(QpStatus, RandomUnboundedProblemsCarryDirections) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    test::Dice dice(seed);
    SparseQp feasible = test::random_sparse(dice);
    // One more variable, free upwards, that costs nothing but pays.
    const int n = feasible.variables();
    SparseQp problem(n + 1, feasible.equalities(), feasible.inequalities());
    feasible.p_matrix.conservativeResize(n + 1, n + 1), problem.p_matrix = feasible.p_matrix;
    feasible.a_matrix.conservativeResize(feasible.equalities(), n + 1), problem.a_matrix = feasible.a_matrix;
    feasible.g_matrix.conservativeResize(feasible.inequalities(), n + 1), problem.g_matrix = feasible.g_matrix;
    problem.b = feasible.b, problem.g_lower = feasible.g_lower, problem.g_upper = feasible.g_upper;
    problem.c << feasible.c, -1.0;
    problem.lower.head(n) = feasible.lower, problem.upper.head(n) = feasible.upper, problem.lower[n] = 0.0;
    const Outcome outcome = run(problem);
    EXPECT_EQ(to_string(outcome.info.status), "dual_infeasible");
    EXPECT_TRUE(proves_unbounded(problem, outcome.solution, 1e-6));
  }
}

TEST(QpStatus, NumericalFailureOnANonconvexProblem) {
  SparseQp problem = two_variables();
  problem.p_matrix.coeffRef(0, 0) = -3.0;
  problem.p_matrix.coeffRef(1, 1) = -3.0;
  problem.lower.setConstant(-HUGE_VAL), problem.upper.setConstant(HUGE_VAL), problem.g_lower.setConstant(-HUGE_VAL);
  EXPECT_EQ(to_string(run(problem).info.status), "numerical_failure");
}

TEST(QpStatus, InvalidProblem) {
  const SparseQp problem = two_variables();
  SparseSolver solver;
  solver.setup(problem);
  SparseSolution solution(problem);
  SparseQp not_finite = problem;
  not_finite.c[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(solver.solve(not_finite, solution).status, Status::invalid_problem);
  SparseQp other_pattern = problem;
  other_pattern.p_matrix.insert(0, 1) = 0.1;
  EXPECT_EQ(solver.solve(other_pattern, solution).status, Status::invalid_problem);
  OcpQp<2, 1> staged(4);
  OcpSolver<2, 1> riccati;
  riccati.setup(staged);
  OcpSolution<2, 1> plan(4);
  staged.stages[2].a(0, 1) = HUGE_VAL;
  EXPECT_EQ(riccati.solve(staged, plan).status, Status::invalid_problem);
  EXPECT_EQ(riccati.solve(OcpQp<2, 1>(3), plan).status, Status::invalid_problem);
}

TEST(QpStatus, EveryStatusHasAName) {
  for (int code = 0; code <= static_cast<int>(Status::invalid_problem); ++code)
    EXPECT_NE(to_string(static_cast<Status>(code)), "unknown");
}

}  // namespace
}  // namespace solenoid::qp
