// The Lotka-Volterra fishing problem against its published answers (mintoc.de), by the same two searches that serve the
// actuator: the generic layer knows neither.
#include "solvers/search/branch_and_bound.hpp"
#include "solvers/search/exhaustive.hpp"
#include "tests/support/lotka_volterra.hpp"

#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using Fishing = LotkaVolterraFishing;

constexpr double relaxed_optimum = 1.34408;     // w in [0, 1]: below every plan
constexpr double two_switch_optimum = 1.38276;  // w in {0, 1}, on shore - fishing - on shore
constexpr int samples = 1200;                   // of 0.01

struct Caught {
  SolveReport report;
  Plan<Fishing> plan;
  double integral = 0.0;
};

template <class Search>
Caught fish(const Problem<Fishing>& problem) {
  Search search;
  search.prepare(problem);
  Caught caught{{}, Plan<Fishing>(problem)};
  caught.report = search.solve(problem, caught.plan, Deadline::never());
  caught.plan.outputs.resize(problem.reference.size());
  EXPECT_EQ(evaluate(problem, caught.plan).cost, caught.report.cost);
  caught.integral = fishing_integral(problem, caught.plan.outputs);
  return caught;
}

std::vector<int> equal_blocks(int count) { return std::vector<int>(static_cast<std::size_t>(count), samples / count); }

/// The step at which each switch of `plan` happens.
std::vector<int> switch_steps(const Problem<Fishing>& problem, const Plan<Fishing>& plan) {
  std::vector<int> steps;
  int begin = 0, before = 0;
  for (std::size_t b = 0; b < plan.modes.size(); begin += problem.horizon.blocks[b], ++b) {
    if (plan.modes[b] != before) steps.push_back(begin);
    before = plan.modes[b];
  }
  return steps;
}

/// Blocks of `cell` steps within `reach` steps of each of two switches, and one block for each of the rests.
std::vector<int> refined_blocks(const std::vector<int>& switches, int reach, int cell) {
  std::vector<int> blocks;
  int at = 0;
  for (const int s : switches) {
    blocks.push_back(s - reach - at);
    blocks.insert(blocks.end(), static_cast<std::size_t>(2 * reach / cell), cell);
    at = s + reach;
  }
  blocks.push_back(samples - at);
  return blocks;
}

TEST(Fishing, RungeKuttaStepsConvergeWithFourthOrder) {
  // w = 0: V = x - ln x + y - ln y is an invariant of the motion, so what it gains is the method's error.
  const auto gained = [](double dt) {
    const auto invariant = [](const Vector<double, 2>& z) { return z[0] - std::log(z[0]) + z[1] - std::log(z[1]); };
    Vector<double, 2> z = {0.5, 0.7};
    const double before = invariant(z);
    for (int i = 0; i < static_cast<int>(std::lround(12 / dt)); ++i) z = Fishing().step<double>(z, {0.0}, {}, dt);
    return std::abs(invariant(z) - before);
  };
  EXPECT_LT(gained(0.1), 1e-6);
  EXPECT_GT(gained(0.4) / gained(0.2), 12.0);  // 2^4, and more while higher terms count
  EXPECT_GT(gained(0.2) / gained(0.1), 12.0);
}

TEST(Fishing, RectanglesConvergeToTheIntegralWithFirstOrderTrapeziaWithSecond) {
  const auto at = [](int steps, bool trapezium) {  // fishing from 2 to 5, predators and prey left alone otherwise
    auto problem = fishing_problem(12.0 / steps, {steps / 6, steps / 4, steps - steps / 6 - steps / 4});
    Plan<Fishing> plan(problem);
    plan.modes = {0, 1, 0};
    plan.outputs.resize(problem.reference.size());
    const double rectangles = evaluate(problem, plan).cost;
    return trapezium ? fishing_integral(problem, plan.outputs) : rectangles;
  };
  const double exact = at(12 << 11, true) + (at(12 << 11, true) - at(12 << 10, true)) / 3;
  EXPECT_NEAR((at(240, false) - exact) / (at(480, false) - exact), 2.0, 0.1);
  EXPECT_NEAR((at(240, true) - exact) / (at(480, true) - exact), 4.0, 0.2);
  EXPECT_NEAR(at(1200, true), exact, 1e-4);
}

TEST(Fishing, BothSearchesFindTheSamePlanToTheLastBit) {
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 40; ++trial) {
    const double switching = trial % 2 ? 0.0 : std::uniform_real_distribution(0.0, 0.1)(random);
    std::vector<int> blocks;
    for (int b = 0; b < 3 + trial % 8; ++b) blocks.push_back(1 + static_cast<int>(random() % 40));
    auto problem = fishing_problem(0.05, blocks, switching);
    problem.initial = {std::uniform_real_distribution(0.3, 1.8)(random),
                       std::uniform_real_distribution(0.3, 1.8)(random)};
    const Caught all = fish<Exhaustive<Fishing>>(problem), pruned = fish<BranchAndBound<Fishing>>(problem);
    EXPECT_EQ(pruned.report.status, Status::optimal);
    EXPECT_EQ(all.report.cost, pruned.report.cost) << trial;
    EXPECT_EQ(all.report.switches, pruned.report.switches) << trial;
    EXPECT_EQ(all.plan.modes, pruned.plan.modes) << trial;
  }
  const auto published = fishing_problem(0.05, std::vector<int>(12, 20));
  const Caught all = fish<Exhaustive<Fishing>>(published), pruned = fish<BranchAndBound<Fishing>>(published);
  EXPECT_EQ(all.plan.modes, pruned.plan.modes);
  EXPECT_EQ(all.report.cost, pruned.report.cost);
  EXPECT_LT(10 * pruned.report.nodes, all.report.nodes);  // 8,190 sequences' blocks
}

TEST(Fishing, TwoSwitchesReachThePublishedOptimum) {
  // Each further pair of switches could save less than 0.04 of cost, so a weight of 0.04 a switch leaves two. Their
  // times are found on half units of time first, then on ever finer grids around where they were.
  constexpr double weight = 0.04;
  auto problem = fishing_problem(0.01, equal_blocks(24), weight);
  Caught caught = fish<BranchAndBound<Fishing>>(problem);
  for (const auto& [reach, cell] : {std::pair{60, 10}, {12, 2}, {4, 1}}) {
    const double before = caught.integral;
    ASSERT_EQ(caught.report.switches, 2);
    problem = fishing_problem(0.01, refined_blocks(switch_steps(problem, caught.plan), reach, cell), weight);
    caught = fish<BranchAndBound<Fishing>>(problem);
    EXPECT_LE(caught.integral, before);
  }
  EXPECT_EQ(caught.report.switches, 2);
  EXPECT_EQ(caught.report.status, Status::optimal);
  EXPECT_NEAR(caught.integral, two_switch_optimum, 5e-5);
}

TEST(Fishing, MoreBlocksFallTowardsTheRelaxedOptimumAndNeverBelow) {
  double before = 1e300;
  for (const int count : {3, 6, 12, 24}) {  // each grid holds the one before
    const auto problem = fishing_problem(0.01, equal_blocks(count));
    const Caught caught = fish<BranchAndBound<Fishing>>(problem);
    EXPECT_EQ(caught.report.status, Status::optimal);
    EXPECT_LT(caught.report.cost, before) << count;
    EXPECT_GT(caught.integral, relaxed_optimum);
    before = caught.report.cost;
  }
  // Fine blocks only where the fleet chatters: from 2 to 7.
  std::vector<int> fine = {200};
  fine.insert(fine.end(), 25, 20);
  fine.push_back(500);
  const Caught caught = fish<BranchAndBound<Fishing>>(fishing_problem(0.01, fine));
  EXPECT_EQ(caught.report.status, Status::optimal);
  EXPECT_GT(caught.integral, relaxed_optimum);
  EXPECT_LT(caught.integral, 1.350);
}

}  // namespace
}  // namespace solenoid
