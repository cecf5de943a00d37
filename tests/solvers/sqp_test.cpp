// The real-time solver of the relaxed problem: recorded programs, derivatives by what they promise, and one test a
// status.
#include "solvers/sqp/sqp.hpp"

#include "tests/support/lotka_volterra.hpp"
#include "tests/support/tracking_sqp.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using test::TrackingSlide;
using SlideSqp = Sqp<TrackingSlide, 2, 0>;
using SlidePlan = RelaxedPlan<TrackingSlide>;

struct SqpOutcome {
  SolveReport report;
  SlidePlan plan;
};

SqpOutcome solved_by_sqp(const Problem<TrackingSlide>& problem, const SqpSettings& settings = {},
                         Deadline deadline = Deadline::never()) {
  const RelaxedGrid grid = control_grid(problem.horizon, 1);
  SlideSqp sqp(settings);
  sqp.prepare(problem, grid);
  SqpOutcome outcome{{}, SlidePlan(problem, grid)};
  outcome.report = sqp.solve(problem, outcome.plan, deadline);
  return outcome;
}

const std::vector<test::RecordedNlp>& recorded() {
  static const auto all = test::recorded_nlps();
  return all;
}

TEST(Sqp, RecordedProgramsReachTheBestKnownCost) {
  int reached = 0;
  for (const auto& one : recorded()) {
    const RelaxedGrid grid = control_grid(one.problem.horizon, 1);
    SlidePlan middle(one.problem, grid);
    SqpOutcome outcome = solved_by_sqp(one.problem);
    EXPECT_TRUE(usable(outcome.report.status));
    EXPECT_LE(outcome.report.cost, relaxed_cost(one.problem, grid, middle));
    EXPECT_EQ(outcome.report.cost, relaxed_cost(one.problem, grid, outcome.plan));
    EXPECT_LE(outcome.report.cost, one.best_known_cost * 1.005);
    reached += outcome.report.cost <= one.best_known_cost * 1.001;
  }
  EXPECT_GE(reached, 98);
}

TEST(Sqp, PlansLieInTheHull) {
  for (std::size_t i = 0; i < recorded().size(); i += 9) {
    const SqpOutcome outcome = solved_by_sqp(recorded()[i].problem);
    for (std::size_t k = 0; k < outcome.plan.intervals(); ++k) {
      double sum = 0.0;
      for (const double w : outcome.plan.row(k)) {
        EXPECT_GE(w, 0.0);
        sum += w;
      }
      EXPECT_NEAR(sum, 1.0, 1e-12);
      EXPECT_LE(std::abs(outcome.plan.continuous[k][0]), 8.0 + 1e-9);
    }
  }
}

TEST(Sqp, RealTimeIterationsConvergeToTheSameCost) {
  for (const std::size_t i : {1u, 17u, 42u}) {
    const auto& problem = recorded()[i].problem;
    const RelaxedGrid grid = control_grid(problem.horizon, 1);
    const SqpOutcome whole = solved_by_sqp(problem);
    SlideSqp sqp({.max_iterations = 1});
    sqp.prepare(problem, grid);
    SlidePlan plan(problem, grid);
    // The first forecast of the state is wrong: the measured one makes up for it.
    Problem<TrackingSlide> forecast = problem;
    forecast.initial[0] += 1e-4, forecast.initial[2] += 2e3;
    SolveReport report;
    for (int step = 0; step < 12; ++step) {
      sqp.anticipate(step == 0 ? forecast : problem, plan);
      report = sqp.solve(problem, plan, Deadline::never());
      EXPECT_TRUE(report.anticipated);
      EXPECT_TRUE(usable(report.status));
    }
    EXPECT_NEAR(report.cost, whole.report.cost, 2e-3 * whole.report.cost) << i;
    EXPECT_EQ(report.cost, relaxed_cost(problem, grid, plan)) << i;
  }
}

TEST(Sqp, WhatWasAnticipatedOtherwiseIsNotUsed) {
  const auto& problem = recorded()[17].problem;
  const RelaxedGrid grid = control_grid(problem.horizon, 1);
  const SqpOutcome alone = solved_by_sqp(problem);
  const auto after = [&](const Problem<TrackingSlide>& expected, bool used) {
    SlideSqp sqp;
    sqp.prepare(problem, grid);
    SlidePlan plan(problem, grid);
    sqp.anticipate(expected, plan);
    const SolveReport report = sqp.solve(problem, plan, Deadline::never());
    EXPECT_EQ(report.anticipated, used);
    EXPECT_NEAR(report.cost, alone.report.cost, 2e-3 * alone.report.cost);
    if (!used) {
      EXPECT_EQ(plan.weights, alone.plan.weights);  // as if nothing had been anticipated
    }
    const SolveReport again = sqp.solve(problem, plan, Deadline::never());
    EXPECT_FALSE(again.anticipated);  // one anticipation, one solve
  };
  after(problem, true);
  auto other = problem;
  other.reference.back()[0] += 0.05;
  after(other, false);
  other = problem;
  other.lines = DelayLines(1);
  after(other, false);
  other = problem;
  other.begins += 5;
  after(other, false);
  other = problem;
  other.initial[1] = std::nan("");
  after(other, false);
}

TEST(Sqp, FishingReachesTheRelaxedOptimum) {
  const auto problem = fishing_problem(0.01, std::vector<int>(240, 5));
  const RelaxedGrid grid = control_grid(problem.horizon, 0);
  Sqp<LotkaVolterraFishing, 1, 0> sqp({.max_iterations = 100, .tolerance = 1e-9});
  sqp.prepare(problem, grid);
  RelaxedPlan<LotkaVolterraFishing> plan(problem, grid);
  const SolveReport report = sqp.solve(problem, plan, Deadline::never());
  EXPECT_TRUE(usable(report.status));
  EXPECT_NEAR(fishing_integral(problem, plan.outputs), 1.34408, 2e-4);
}

TEST(Sqp, NoSwitchingCostMeansLessCostThanWithIt) {
  auto problem = fishing_problem(0.05, std::vector<int>(24, 10), 0.05);
  const RelaxedGrid grid = control_grid(problem.horizon, 0);
  Sqp<LotkaVolterraFishing, 1, 1> sqp;
  sqp.prepare(problem, grid);
  const auto rises_and_falls = [&](double weight) {
    problem.cost.switching = weight;
    RelaxedPlan<LotkaVolterraFishing> plan(problem, grid);
    const SolveReport report = sqp.solve(problem, plan, Deadline::never());
    EXPECT_TRUE(usable(report.status));
    double sum = std::abs(plan.row(0)[1]);
    for (std::size_t k = 1; k < grid.size(); ++k) sum += std::abs(plan.row(k)[1] - plan.row(k - 1)[1]);
    return sum;
  };
  const double free = rises_and_falls(0.0), dear = rises_and_falls(0.3);
  EXPECT_LT(dear, 0.9 * free);
}

TEST(SqpStatus, Optimal) { EXPECT_EQ(solved_by_sqp(recorded()[0].problem).report.status, Status::optimal); }

TEST(SqpStatus, FeasibleWhereEveryStepIsRefused) {
  int feasible = 0;
  for (const auto& one : recorded()) {  // a tolerance that only a refused step can end
    const SqpOutcome outcome = solved_by_sqp(one.problem, {.tolerance = 0.0, .defect = 0.0, .refusals = 0});
    feasible += outcome.report.status == Status::feasible;
    SlidePlan middle(one.problem, control_grid(one.problem.horizon, 1));
    EXPECT_LT(outcome.report.cost, relaxed_cost(one.problem, control_grid(one.problem.horizon, 1), middle));
  }
  EXPECT_GT(feasible, 0);
}

TEST(SqpStatus, IterationLimit) {
  const SqpOutcome outcome = solved_by_sqp(recorded()[5].problem, {.max_iterations = 1});
  EXPECT_EQ(outcome.report.status, Status::iteration_limit);
  EXPECT_TRUE(std::isfinite(outcome.report.cost));
}

TEST(SqpStatus, DeadlineReached) {
  const SqpOutcome outcome = solved_by_sqp(recorded()[5].problem, {}, Deadline::after(std::chrono::nanoseconds(0)));
  EXPECT_EQ(outcome.report.status, Status::deadline_reached);
  EXPECT_TRUE(std::isfinite(outcome.report.cost));
}

TEST(SqpStatus, InfeasibleStateBounds) {
  Problem<TrackingSlide> problem = recorded()[5].problem;
  problem.bounds.state_lower[0] = 0.2;  // beyond any slide's reach in a tenth of a second
  EXPECT_EQ(solved_by_sqp(problem).report.status, Status::infeasible);
}

TEST(SqpStatus, NumericalFailure) {
  Problem<TrackingSlide> problem = recorded()[5].problem;
  problem.initial[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(solved_by_sqp(problem).report.status, Status::numerical_failure);
}

}  // namespace
}  // namespace solenoid
