// Rounding where of a group of switches one may change at a time: a three-level phase of two gate signals, which goes
// from -1 to 1 by way of 0.
#include "solvers/rounding/mode_swaps.hpp"
#include "solvers/rounding/pulse_width.hpp"
#include "solvers/rounding/sum_up_rounding.hpp"
#include "tests/support/double_integrator.hpp"
#include "tests/support/random_weights.hpp"

#include <cmath>
#include <random>
#include <utility>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// Levels -1, 0, 1 of one phase; their patterns 0, 1, 3.
ModeSet three_levels() {
  return {"three_levels", {{"lower"}, {"upper"}}, {{"-", 0}, {"0", 1}, {"+", 3}}, {-1.0}, {{1.0}, {1.0}}, {3}};
}

TEST(OneAtATime, SumUpRoundingFollowsTheWeightsByNeighbours) {
  std::mt19937_64 random(1);
  const ModeSet modes = three_levels();
  const SwitchTiming timing(modes, 1.0);
  int detours = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const ModeWeights weights = test::random_weights(random, 3, 30, true);
    const int first = static_cast<int>(random() % 3);
    const SwitchLimits limits = mode_set_limits(modes, timing, DelayLines(modes.pattern(first)));
    std::vector<int> rounded(weights.intervals()), free_of_limits;
    std::vector<double> owed(3);
    const SumUpReport report = sum_up_rounding(weights, limits, rounded, owed);
    ASSERT_EQ(report.status, Status::feasible);
    EXPECT_EQ(report.gap, integral_gap(weights, rounded));
    EXPECT_TRUE(walk_limits(limits, weights.dt, rounded).allowed);
    int before = first;
    for (const int mode : rounded) EXPECT_LE(std::abs(mode - std::exchange(before, mode)), 1) << trial;
    sum_up_rounding(weights, free_of_limits);
    detours += rounded != free_of_limits;
    // What is allowed anyway stays as it was.
    SwitchLimits none = limits;
    none.one_at_a_time.clear();
    sum_up_rounding(weights, none, rounded, owed);
    EXPECT_EQ(rounded, free_of_limits);
  }
  EXPECT_GT(detours, 50);
}

TEST(OneAtATime, PulsesGoByNeighboursAndKeepTheMean) {
  const ModeSet modes = three_levels();
  constexpr double dt = 0.001;
  const SwitchTiming timing(modes, dt);
  const RelaxedGrid grid{{5, 5}};
  PulseWidth pulses;
  pulses.prepare(modes, timing, grid);
  for (const double level : {-1.0, -0.73, -0.5, 0.0, 0.31, 0.8, 1.0})
    for (const double spread : {0.0, 0.2}) {  // the share of both outer levels beyond what the mean needs
      const double up = std::max(level, 0.0) + spread / 2 * (1 - std::abs(level));
      const double down = std::max(-level, 0.0) + spread / 2 * (1 - std::abs(level));
      const std::vector<double> row = {down, 1 - up - down, up, down, 1 - up - down, up};
      DelayLines lines(level > 0 ? 0 : 3);  // the way is from the other end
      SwitchStates<double> owed{};
      std::vector<int> mode(10);
      std::vector<SwitchStates<double>> owes(mode.size());
      double sum = 0.0;
      for (int period = 0; period < 200; ++period) {
        pulses.round(modes, lines, row, owed, mode, owes);
        for (std::size_t i = 0; i < 5; ++i) {
          ASSERT_TRUE(lines.may_command(modes.pattern(mode[i]), timing));
          lines.command(modes.pattern(mode[i]), timing);
          sum += modes.point(lines.effective())[0];
          lines.advance(1);
        }
        owed = owes[5];
      }
      // Where both outer levels are wanted, the pulses of one signal cost the other some of its time.
      EXPECT_NEAR(sum / 1000, level, spread > 0 ? 0.1 : 0.01) << level << " " << spread;
    }
}

TEST(OneAtATime, ModeSwapsKeepToItAndRepairPlansThatDoNot) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution uniform(-1.0, 1.0);
  int repaired = 0;
  for (int trial = 0; trial < 60; ++trial) {
    Cost<DoubleIntegrator> cost;
    cost.tracking = {1.0, 0.1};
    cost.switching = 0.01;
    Problem<DoubleIntegrator> problem(DoubleIntegrator{}, three_levels(), {0.1, std::vector<int>(8, 2)}, cost);
    problem.initial = {uniform(random), uniform(random)};
    for (auto& r : problem.reference) r = {uniform(random), 0.0};
    problem.lines = DelayLines(1);
    Plan<DoubleIntegrator> plan(problem);
    for (int& mode : plan.modes) mode = static_cast<int>(random() % 3);
    const bool kept = evaluate(problem, plan).status == Status::feasible;
    ModeSwaps<DoubleIntegrator> swaps;
    swaps.prepare(problem);
    const SolveReport report = swaps.improve(problem, plan, Deadline::never());
    if (report.status != Status::feasible) {  // more than one step away from a plan that keeps to it
      EXPECT_FALSE(kept);
      continue;
    }
    repaired += !kept;
    int before = 1;
    for (const int mode : plan.modes) EXPECT_LE(std::abs(mode - std::exchange(before, mode)), 1);
  }
  EXPECT_GT(repaired, 3);
}

}  // namespace
}  // namespace solenoid
