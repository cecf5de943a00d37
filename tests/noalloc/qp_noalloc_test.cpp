#include "core/rt/allocation_guard.hpp"
#include "solvers/qp/ocp_solver.hpp"
#include "solvers/qp/sparse_solver.hpp"
#include "tests/support/random_qp.hpp"

#include <set>

#include <gtest/gtest.h>

namespace solenoid::qp {
namespace {

template <class Solver, class Problem, class Solution>
Status fenced(Solver& solver, const Problem& problem, Solution& solution, Start start,
              Deadline deadline = Deadline::never()) {
  const auto before = AllocationGuard::thread_allocations();
  const Info info = solver.solve(problem, solution, start, deadline);
  EXPECT_EQ(AllocationGuard::thread_allocations(), before) << to_string(info.status);
  return info.status;
}

TEST(QpNoAlloc, OcpSolveAtEveryStatus) {
  ASSERT_TRUE(AllocationGuard::available());
  static_assert(noexcept(std::declval<OcpSolver<4, 3>&>().solve(
      std::declval<const OcpQp<4, 3>&>(), std::declval<OcpSolution<4, 3>&>(), Start::cold, std::declval<Deadline>())));
  std::set<Status> seen;
  test::Dice dice(3);
  const auto problem = test::random_ocp<4, 3>(dice, 10, true);
  OcpSolution<4, 3> solution(10);
  for (const int limit : {1, 100}) {
    OcpSolver<4, 3> solver;
    solver.setup(problem, {.max_iterations = limit});
    seen.insert(fenced(solver, problem, solution, Start::cold));
    seen.insert(fenced(solver, problem, solution, Start::warm));
    seen.insert(fenced(solver, problem, solution, Start::cold, Deadline::after(std::chrono::nanoseconds(0))));
    auto variant = problem;
    variant.stages[7].x_lower[0] = 1e4, variant.stages[7].x_upper[0] = HUGE_VAL;
    for (auto& stage : variant.stages) stage.u_lower.setConstant(-1.0), stage.u_upper.setConstant(1.0);
    seen.insert(fenced(solver, variant, solution, Start::cold));
    variant = problem;
    for (auto& stage : variant.stages) {
      stage.q_matrix.setZero(), stage.r_matrix.setZero(), stage.s_matrix.setZero();
      stage.u_lower.setConstant(-HUGE_VAL), stage.u_upper.setConstant(HUGE_VAL);
      stage.x_lower.setConstant(-HUGE_VAL), stage.x_upper.setConstant(HUGE_VAL);
    }
    seen.insert(fenced(solver, variant, solution, Start::cold));
    variant = problem;
    variant.stages[0].r_matrix.setConstant(-5.0);
    for (auto& stage : variant.stages) stage.r_matrix.setIdentity(), stage.r_matrix *= -50.0;
    seen.insert(fenced(solver, variant, solution, Start::cold));
    variant = problem;
    variant.stages[1].c[0] = HUGE_VAL;
    seen.insert(fenced(solver, variant, solution, Start::cold));
  }
  EXPECT_EQ(seen, (std::set<Status>{Status::optimal, Status::iteration_limit, Status::deadline_reached,
                                    Status::primal_infeasible, Status::dual_infeasible, Status::numerical_failure,
                                    Status::invalid_problem}));
}

TEST(QpNoAlloc, SparseSolveOnRandomProblems) {
  ASSERT_TRUE(AllocationGuard::available());
  for (unsigned seed = 0; seed < 40; ++seed) {
    test::Dice dice(seed);
    auto problem = test::random_sparse(dice, seed % 2 == 0);
    SparseSolver solver;
    solver.setup(problem);
    SparseSolution solution(problem);
    EXPECT_EQ(fenced(solver, problem, solution, Start::cold), Status::optimal);
    fenced(solver, problem, solution, Start::warm);
    problem.c *= 1e6;
    fenced(solver, problem, solution, Start::cold);
    if (problem.inequalities() > 0) problem.g_lower.setConstant(1e3), problem.g_upper.setConstant(1e3);
    fenced(solver, problem, solution, Start::cold);
  }
}

}  // namespace
}  // namespace solenoid::qp
