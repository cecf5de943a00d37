#include "solvers/qp/kkt_error.hpp"
#include "solvers/qp/ocp_solver.hpp"
#include "solvers/qp/ocp_to_sparse.hpp"
#include "solvers/qp/sparse_solver.hpp"
#include "tests/support/random_qp.hpp"

#include <gtest/gtest.h>

namespace solenoid::qp {
namespace {

using test::Dice;
using test::random_ocp;

/// Both back ends on one problem: each convinces the judge, and they agree on the objective.
template <int NX, int NU>
void expect_agreement(const OcpQp<NX, NU>& problem, const Settings& settings = {}) {
  OcpSolver<NX, NU> staged;
  staged.setup(problem, settings);
  OcpSolution<NX, NU> solution(problem.horizon());
  const Info info = staged.solve(problem, solution);
  ASSERT_EQ(to_string(info.status), "optimal");
  const KktError error = kkt_error(problem, solution);
  EXPECT_LE(error.largest(), 1e-8);

  const SparseQp flat = to_sparse(problem);
  SparseSolver sparse;
  sparse.setup(flat, settings);
  SparseSolution flat_solution(flat);
  ASSERT_EQ(to_string(sparse.solve(flat, flat_solution).status), "optimal");
  const KktError flat_error = kkt_error(flat, flat_solution);
  EXPECT_LE(flat_error.largest(), 1e-8);
  EXPECT_NEAR(error.objective, flat_error.objective, 1e-7 * (1.0 + std::abs(error.objective)));
  // The inputs' Hessian is positive definite, so the optimum is unique.
  for (int k = 0; k < problem.horizon(); ++k)
    for (int j = 0; j < NU; ++j)
      EXPECT_NEAR(solution.u[static_cast<std::size_t>(k)][j], flat_solution.x[k * (NX + NU) + j], 1e-3);
}

template <int NX, int NU>
void sweep(unsigned seeds) {
  for (unsigned seed = 0; seed < seeds; ++seed)
    for (const bool state_bounds : {false, true}) {
      SCOPED_TRACE(testing::Message() << NX << " states, " << NU << " inputs, seed " << seed << " bounds "
                                      << state_bounds);
      Dice dice(seed);
      expect_agreement(random_ocp<NX, NU>(dice, dice.integer(1, 12), state_bounds));
    }
}

TEST(QpOcp, BackEndsAgreeOnRandomProblemsOfEverySize) {
  sweep<1, 1>(40);
  sweep<2, 1>(40);
  sweep<3, 2>(40);
  sweep<4, 3>(60);
  sweep<6, 3>(30);
}

TEST(QpOcp, SizesWithoutTheirOwnKernelsWork) { sweep<5, 2>(20); }

TEST(QpOcp, InteriorPointAloneSolvesWhatTheActiveSetFinishDoes) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    Dice dice(seed);
    expect_agreement(random_ocp<4, 3>(dice, dice.integer(1, 12), seed % 2 == 0), {.active_set_steps = 0});
  }
}

TEST(QpOcp, OneStageOneInputHasItsClosedForm) {
  // minimise u^2 / 2 + (x0 + u - 1)^2 / 2 over |u| <= limit: u = clamp((1 - x0) / 2).
  for (const double limit : {0.1, 0.25, 10.0})
    for (const double x0 : {-0.5, 0.5, 3.0}) {
      OcpQp<1, 1> problem(1);
      problem.x0[0] = x0;
      problem.stages[0].a(0, 0) = problem.stages[0].b(0, 0) = problem.stages[0].r_matrix(0, 0) = 1.0;
      problem.stages[0].u_lower[0] = -limit, problem.stages[0].u_upper[0] = limit;
      problem.stages[1].q_matrix(0, 0) = 1.0, problem.stages[1].q[0] = -1.0;
      OcpSolver<1, 1> solver;
      solver.setup(problem);
      OcpSolution<1, 1> solution(1);
      ASSERT_EQ(solver.solve(problem, solution).status, Status::optimal);
      EXPECT_NEAR(solution.u[0][0], std::clamp((1.0 - x0) / 2.0, -limit, limit), 1e-8);
      EXPECT_NEAR(solution.x[1][0], x0 + solution.u[0][0], 1e-12);
    }
}

TEST(QpOcp, UnconstrainedProblemIsOneFactorisation) {
  Dice dice(5);
  auto problem = random_ocp<4, 3>(dice, 10, false);
  for (auto& stage : problem.stages) stage.u_lower.setConstant(-HUGE_VAL), stage.u_upper.setConstant(HUGE_VAL);
  OcpSolver<4, 3> solver;
  solver.setup(problem);
  OcpSolution<4, 3> solution(10);
  EXPECT_EQ(solver.solve(problem, solution).iterations, 1);
  EXPECT_LE(kkt_error(problem, solution).largest(), 1e-8);
}

TEST(QpOcp, StateBoundsOutOfReachArePrimalInfeasibleWithACertificate) {
  Dice dice(11);
  auto problem = random_ocp<4, 3>(dice, 8, true);
  problem.stages[5].u_lower.setConstant(-1.0), problem.stages[5].u_upper.setConstant(1.0);
  for (auto& stage : problem.stages) {
    stage.u_lower.setConstant(-1.0), stage.u_upper.setConstant(1.0);
    stage.x_lower.setConstant(-HUGE_VAL), stage.x_upper.setConstant(HUGE_VAL);
  }
  problem.stages[8].x_lower[2] = 1e3;
  OcpSolver<4, 3> solver;
  solver.setup(problem);
  OcpSolution<4, 3> solution(8);
  ASSERT_EQ(to_string(solver.solve(problem, solution).status), "primal_infeasible");
  const SparseQp flat = to_sparse(problem);
  SparseSolution ray(flat);
  for (int k = 0; k < 8; ++k) {
    const auto at = static_cast<std::size_t>(k);
    ray.y.segment<4>(4 * k) = solution.y[at];
    ray.z_box.segment<3>(7 * k) = solution.zu[at];
    ray.z_box.segment<4>(7 * k + 3) = solution.zx[at + 1];
  }
  EXPECT_TRUE(proves_infeasible(flat, ray, 1e-6));
}

TEST(QpOcp, FreeInputWithoutCostIsDualInfeasibleWithADirection) {
  OcpQp<2, 1> problem(3);
  for (auto& stage : problem.stages) stage.a.setIdentity();  // b = 0: the input moves nothing and is paid for linearly
  problem.stages[1].r[0] = -2.0;
  problem.stages[1].u_lower[0] = 0.0;
  OcpSolver<2, 1> solver;
  solver.setup(problem);
  OcpSolution<2, 1> solution(3);
  ASSERT_EQ(to_string(solver.solve(problem, solution).status), "dual_infeasible");
  const SparseQp flat = to_sparse(problem);
  SparseSolution ray(flat);
  for (int k = 0; k < 3; ++k) {
    ray.x[3 * k] = solution.u[static_cast<std::size_t>(k)][0];
    ray.x.segment<2>(3 * k + 1) = solution.x[static_cast<std::size_t>(k) + 1];
  }
  EXPECT_TRUE(proves_unbounded(flat, ray, 1e-6));
}

}  // namespace
}  // namespace solenoid::qp
