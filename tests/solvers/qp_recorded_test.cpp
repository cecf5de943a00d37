#include "solvers/qp/kkt_error.hpp"
#include "solvers/qp/ocp_solver.hpp"
#include "solvers/qp/ocp_to_sparse.hpp"
#include "solvers/qp/sparse_solver.hpp"
#include "tests/support/recorded_qp.hpp"

#include <gtest/gtest.h>

namespace solenoid::qp {
namespace {

// Optima here are as small as 1e-6, so the cost is held to 1e-6 of itself, plus what the reference can know: it was
// solved to 1e-11 and printed to 1e-15.
void expect_cost(double cost, double optimum) { EXPECT_NEAR(cost, optimum, 1e-6 * std::abs(optimum) + 1e-11); }

class Recorded : public testing::TestWithParam<int> {};

TEST_P(Recorded, RiccatiSolvesEveryInstanceToTheJudgesSatisfaction) {
  for (const Isa isa : {Isa::baseline, Isa::avx2, Isa::avx512})
    for (const int active_set_steps : {0, Settings{}.active_set_steps}) {
      const auto all = test::recorded_qps(GetParam());
      ASSERT_EQ(all.size(), 100u);
      OcpSolver<4, 3> solver;
      solver.setup(all[0].problem, {.active_set_steps = active_set_steps, .isa = isa});
      OcpSolution<4, 3> solution(GetParam());
      for (std::size_t i = 0; i < all.size(); ++i) {
        SCOPED_TRACE(i);
        const Info info = solver.solve(all[i].problem, solution);
        ASSERT_EQ(info.status, Status::optimal);
        const KktError error = kkt_error(all[i].problem, solution);
        EXPECT_LE(error.largest(), 1e-8);
        expect_cost(error.objective, all[i].optimal_cost);
        EXPECT_NEAR(info.objective, error.objective, 1e-12 * (1.0 + std::abs(error.objective)));
      }
    }
}

TEST_P(Recorded, InstructionSetsAgree) {
  const auto all = test::recorded_qps(GetParam());
  for (const int active_set_steps : {0, Settings{}.active_set_steps}) {
    const auto solver_of = [&](Isa isa) {
      OcpSolver<4, 3> solver;
      solver.setup(all[0].problem, {.active_set_steps = active_set_steps, .isa = isa});
      return solver;
    };
    auto reference = solver_of(Isa::baseline);
    OcpSolution<4, 3> solution(GetParam());
    for (const Isa isa : {Isa::avx2, Isa::avx512}) {
      auto solver = solver_of(isa);
      for (std::size_t i = 0; i < all.size(); ++i) {
        SCOPED_TRACE(i);
        const Info expected = reference.solve(all[i].problem, solution);
        const Info info = solver.solve(all[i].problem, solution);
        EXPECT_EQ(info.status, expected.status);
        EXPECT_NEAR(info.iterations, expected.iterations, 1);
        EXPECT_NEAR(info.objective, expected.objective, 1e-9);
      }
    }
  }
}

TEST_P(Recorded, SparseSolvesEveryInstanceToTheJudgesSatisfaction) {
  const auto all = test::recorded_qps(GetParam());
  SparseQp problem = to_sparse(all[0].problem);
  for (const int active_set_steps : {0, Settings{}.active_set_steps}) {
    SparseSolver solver;
    solver.setup(problem, {.active_set_steps = active_set_steps});
    SparseSolution solution(problem);
    for (std::size_t i = 0; i < all.size(); ++i) {
      SCOPED_TRACE(i);
      problem = to_sparse(all[i].problem);
      ASSERT_EQ(solver.solve(problem, solution).status, Status::optimal);
      const KktError error = kkt_error(problem, solution);
      EXPECT_LE(error.largest(), 1e-8);
      expect_cost(error.objective, all[i].optimal_cost);
    }
  }
}

TEST_P(Recorded, WarmStartFromTheNeighbourSolvesToo) {
  const auto all = test::recorded_qps(GetParam());
  OcpSolver<4, 3> solver;
  solver.setup(all[0].problem);
  OcpSolution<4, 3> solution(GetParam());
  solver.solve(all[0].problem, solution);
  for (std::size_t i = 1; i < all.size(); ++i) {
    SCOPED_TRACE(i);
    ASSERT_EQ(solver.solve(all[i].problem, solution, Start::warm).status, Status::optimal);
    const KktError error = kkt_error(all[i].problem, solution);
    EXPECT_LE(error.largest(), 1e-8);
    expect_cost(error.objective, all[i].optimal_cost);
  }
}

TEST_P(Recorded, WarmStartFromTheSolutionItselfTakesOneStep) {
  const auto all = test::recorded_qps(GetParam());
  OcpSolver<4, 3> solver;
  solver.setup(all[0].problem);
  OcpSolution<4, 3> solution(GetParam());
  for (const auto& one : all) {
    const Info cold = solver.solve(one.problem, solution);
    const Info warm = solver.solve(one.problem, solution, Start::warm);
    EXPECT_LE(warm.iterations, std::min(2, cold.iterations));
    EXPECT_LE(kkt_error(one.problem, solution).largest(), 1e-8);
  }
}

INSTANTIATE_TEST_SUITE_P(Horizons, Recorded, testing::Values(20, 40));

}  // namespace
}  // namespace solenoid::qp
