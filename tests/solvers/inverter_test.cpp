// The searches on the three-level inverter against sphere decoding, the field's own method, and plain enumeration.
#include "core/mpc/rollout.hpp"
#include "solvers/search/branch_and_bound.hpp"
#include "solvers/search/exhaustive.hpp"
#include "tests/support/inverter_problems.hpp"
#include "tests/support/sphere_decoder.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

std::array<int, 3> levels_of(const ModeSet& modes, SwitchPattern pattern) {
  const auto point = modes.point(pattern);
  return {static_cast<int>(point[0]), static_cast<int>(point[1]), static_cast<int>(point[2])};
}

test::SphereDecoder::Answer decode(test::SphereDecoder& decoder, const Problem<InverterLoad>& problem) {
  std::vector<Eigen::Vector2d> reference;
  for (const auto& r : problem.reference) reference.emplace_back(r[0], r[1]);
  const auto& x = problem.initial;
  return decoder.solve({x[0], x[1], x[2], x[3]}, levels_of(problem.modes, problem.lines.commanded()), reference);
}

/// The optimum is the decoder's, and the plan is worth that.
void expect_as_decoded(int steps, double lambda, int trials, unsigned seed) {
  std::mt19937_64 random(seed);
  auto problem = test::inverter_problem(steps, lambda);
  test::SphereDecoder decoder(problem.model.parameters(), problem.horizon.dt_s, steps, lambda);
  BranchAndBound<InverterLoad> search;
  search.prepare(problem);
  int moved = 0, same = 0;
  trials /= SOLENOID_TEST_ONE_IN;
  for (int trial = 0; trial < trials; ++trial) {
    test::pose_at_random(problem, random);
    const auto decoded = decode(decoder, problem);
    Plan<InverterLoad> plan(problem);
    const SolveReport report = search.solve(problem, plan, Deadline::never());
    ASSERT_EQ(report.status, Status::optimal);
    EXPECT_NEAR(report.cost, decoded.cost, 1e-12 * decoded.cost) << trial;
    EXPECT_EQ(evaluate(problem, plan).cost, report.cost);
    moved += report.switches > 0;
    bool equal = true;
    for (std::size_t b = 0; b < plan.modes.size(); ++b)
      equal = equal && levels_of(problem.modes, problem.modes.pattern(plan.modes[b])) == decoded.levels[b];
    same += equal;
  }
  EXPECT_GT(moved, trials / 4);
  EXPECT_GT(same, trials * 9 / 10);  // the others are ties
}

TEST(Inverter, BranchAndBoundAgreesWithSphereDecodingOverFiveSteps) { expect_as_decoded(5, 3000.0, 1000, 1); }

TEST(Inverter, BranchAndBoundAgreesWithSphereDecodingWhereSwitchingIsCheap) {
  for (const int steps : {1, 2, 3, 4}) expect_as_decoded(steps, 100.0, 300, 2);
}

TEST(Inverter, OneStepIsWhatEnumerationFinds) {
  std::mt19937_64 random(3);
  auto problem = test::inverter_problem(1, 500.0);
  BranchAndBound<InverterLoad> search;
  Exhaustive<InverterLoad> all;
  search.prepare(problem);
  all.prepare(problem);
  for (int trial = 0; trial < 1000 / SOLENOID_TEST_ONE_IN; ++trial) {
    test::pose_at_random(problem, random);
    const auto before = levels_of(problem.modes, problem.lines.commanded());
    double least = HUGE_VAL;
    for (const Mode& mode : problem.modes.modes()) {
      const auto u = levels_of(problem.modes, mode.pattern);
      int largest = 0, sum = 0;
      for (std::size_t phase = 0; phase < 3; ++phase) {
        largest = std::max(largest, std::abs(u[phase] - before[phase]));
        sum += std::abs(u[phase] - before[phase]);
      }
      if (largest > 1) continue;
      const auto next = problem.model.step<double>(
          problem.initial, {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])}, {},
          problem.horizon.dt_s);
      least = std::min(least, 500.0 * sum + std::pow(problem.reference[0][0] - next[0], 2) +
                                  std::pow(problem.reference[0][1] - next[1], 2));
    }
    Plan<InverterLoad> plan(problem), oracle(problem);
    const SolveReport report = search.solve(problem, plan, Deadline::never());
    EXPECT_NEAR(report.cost, least, 1e-12 * least);
    EXPECT_EQ(all.solve(problem, oracle, Deadline::never()).cost, report.cost);
    EXPECT_EQ(plan.modes, oracle.modes);
  }
}

TEST(Inverter, BranchAndBoundIsExhaustiveOnTwoSteps) {
  for (const char* inverter : {"three_level", "two_level"}) {
    std::mt19937_64 random(4);
    InverterParameters delayed;
    delayed.switching_delay_s = delayed.sampling_s;
    for (const InverterParameters& p : {InverterParameters(), delayed}) {
      auto problem = test::inverter_problem(2, 800.0, p, inverter);
      problem.cost.terminal = {0.5, 2.0};
      BranchAndBound<InverterLoad> search;
      Exhaustive<InverterLoad> all;
      search.prepare(problem);
      all.prepare(problem);
      for (int trial = 0; trial < 200 / SOLENOID_TEST_ONE_IN; ++trial) {
        test::pose_at_random(problem, random);
        Plan<InverterLoad> plan(problem), oracle(problem);
        const SolveReport report = search.solve(problem, plan, Deadline::never());
        const SolveReport truth = all.solve(problem, oracle, Deadline::never());
        EXPECT_EQ(report.cost, truth.cost) << inverter << trial;
        EXPECT_EQ(plan.modes, oracle.modes);
      }
    }
  }
}

}  // namespace
}  // namespace solenoid
