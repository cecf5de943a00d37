// The relaxed problem's gradient against differences, and Bonmin against enumeration.
#include "core/systems/actuator/prestabilised.hpp"
#include "core/systems/actuator/valves.hpp"
#include "solvers/minlp/bonmin.hpp"
#include "solvers/search/exhaustive.hpp"
#include "tests/support/lotka_volterra.hpp"
#include "tests/support/uniform.hpp"

#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using Fishing = LotkaVolterraFishing;

template <HybridModel M>
void expect_gradient(const Problem<M>& problem, std::mt19937_64& random, double step_u, double tolerance) {
  const RelaxedGrid grid = control_grid(problem.horizon, 0);
  RelaxedPlan<M> plan(problem, grid);
  for (double& w : plan.weights) w = uniform(random, 0.05, 0.3);
  for (auto& u : plan.continuous)
    for (double& value : u) value = uniform(random, -2.0, 2.0);
  RelaxedGradient<M> gradient;
  gradient.prepare(problem, grid);
  std::vector<double> by_weight(plan.weights.size());
  std::vector<ContinuousOf<M>> by_u(plan.continuous.size());
  const double cost = gradient(problem, plan.weights, plan.continuous, by_weight, by_u);
  EXPECT_NEAR(cost, relaxed_cost(problem, grid, plan), 1e-12 * cost);
  const auto slope = [&](double& at, double h) {
    const double before = at;
    at = before + h;
    const double above = relaxed_cost(problem, grid, plan);
    at = before - h;
    const double below = relaxed_cost(problem, grid, plan);
    at = before;
    return (above - below) / (2 * h);
  };
  double largest = 0.0;
  for (const double g : by_weight) largest = std::max(largest, std::abs(g));
  for (std::size_t i = 0; i < by_weight.size(); ++i)
    EXPECT_NEAR(slope(plan.weights[i], 1e-6), by_weight[i], tolerance * largest) << i;
  for (std::size_t k = 0; k < by_u.size(); ++k)
    for (std::size_t i = 0; i < M::continuous_size; ++i) {
      const double numeric = slope(plan.continuous[k][i], step_u);
      EXPECT_NEAR(numeric, by_u[k][i], tolerance * (std::abs(numeric) + 1e-3 * cost)) << k;
    }
}

TEST(RelaxedGradient, AgreesWithDifferences) {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 10; ++trial) {
    auto fishing = fishing_problem(0.05, {5, 20, 10, 30}, 0.01);
    fishing.cost.terminal = {0.3, 0.1};
    expect_gradient(fishing, random, 1e-6, 1e-6);
  }
  const ActuatorParameters p;
  Cost<PneumaticActuator> cost;
  cost.tracking = {1.0, 0.01};
  cost.terminal = {3.0, 0.1};
  cost.switching = 1e-6;
  cost.consumption = 0.1;
  cost.continuous = {1e-8};
  Problem<PneumaticActuator> problem(PneumaticActuator(p), valve_modes("two_way", p), {0.001, {5, 10, 20}}, cost);
  problem.lines.command(5, SwitchTiming(problem.modes, 0.001));
  problem.lines.advance(2);
  for (auto& r : problem.reference) r = {0.05, 0.1};
  for (int trial = 0; trial < 5; ++trial) {  // sliding all along: no kink of friction on the way
    problem.initial = {uniform(random, 0.03, 0.06), uniform(random, 0.3, 0.5), uniform(random, 1.4e5, 1.5e5),
                       uniform(random, 1.4e5, 1.5e5)};
    expect_gradient(problem, random, 1e-4, 1e-4);
  }
}

TEST(Bonmin, RefusesSwitchesThatChangeOneAtATime) {
  auto problem = fishing_problem(0.1, {20});
  problem.modes = ModeSet("two", {{"fleet"}, {"spare"}}, {{"ashore", 0}, {"fishing", 1}}, {0.0}, {{1.0}, {0.0}}, {3});
  BonminSolver<Fishing> bonmin;
  EXPECT_THROW(bonmin.prepare(problem), std::invalid_argument);
}

TEST(Bonmin, FindsTheBestPlanOfSmallProblemsOrNearly) {
  if (!minlp::available()) GTEST_SKIP() << "built without Bonmin";
  std::mt19937_64 random(2);
  int best = 0;
  constexpr int trials = 6;
  for (int trial = 0; trial < trials; ++trial) {
    auto problem = fishing_problem(0.1, {20, 20, 20, 20, 20, 20});
    problem.initial = {uniform(random, 0.4, 1.6), uniform(random, 0.4, 1.6)};
    Exhaustive<Fishing> all;
    all.prepare(problem);
    Plan<Fishing> optimal(problem), plan(problem);
    const double optimum = all.solve(problem, optimal, Deadline::never()).cost;
    BonminSolver<Fishing> bonmin;
    bonmin.prepare(problem);
    const double before = evaluate(problem, plan).cost;
    const SolveReport report = bonmin.solve(problem, plan, Deadline::never());
    EXPECT_TRUE(usable(report.status));
    EXPECT_EQ(report.cost, evaluate(problem, plan).cost);
    EXPECT_GE(report.cost, optimum);
    EXPECT_LE(report.cost, before);
    best += report.cost <= optimum * (1 + 1e-9);
  }
  EXPECT_GE(best, trials * 2 / 3);
}

TEST(Bonmin, ItsOtherAlgorithmsFindPlansThatAreWhatTheySay) {
  if (!minlp::available()) GTEST_SKIP() << "built without Bonmin";
  using enum minlp::Algorithm;
  for (const minlp::Algorithm algorithm : {outer_approximation, feasibility_pump}) {
    std::mt19937_64 random(4);
    int better = 0;
    for (int trial = 0; trial < 6; ++trial) {
      auto problem = fishing_problem(0.1, {20, 20, 20, 20, 20});
      problem.initial = {uniform(random, 0.4, 1.6), uniform(random, 0.4, 1.6)};
      Exhaustive<Fishing> all;
      all.prepare(problem);
      Plan<Fishing> optimal(problem), plan(problem);
      const double optimum = all.solve(problem, optimal, Deadline::never()).cost;
      BonminSolver<Fishing> bonmin(algorithm);
      bonmin.prepare(problem);
      const double before = evaluate(problem, plan).cost;
      const SolveReport report = bonmin.solve(problem, plan, Deadline::after(std::chrono::seconds(20)));
      EXPECT_EQ(report.cost, evaluate(problem, plan).cost);
      EXPECT_GE(report.cost, optimum);
      EXPECT_LE(report.cost, before);
      better += usable(report.status) && report.cost < before;
      if (algorithm == outer_approximation) {
        EXPECT_TRUE(usable(report.status)) << to_string(report.status);
      }
    }
    EXPECT_GE(better, 2) << "plans of its own; the pump's solver of linear problems now and then fails an assertion";
  }
}

TEST(Bonmin, KeepsTheDeadlineAndTheWarmStart) {
  if (!minlp::available()) GTEST_SKIP() << "built without Bonmin";
  auto problem = fishing_problem(0.05, std::vector<int>(12, 20));
  Plan<Fishing> plan(problem);
  plan.modes = {0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0};
  const double before = evaluate(problem, plan).cost;
  BonminSolver<Fishing> bonmin;
  bonmin.prepare(problem);
  const SolveReport report = bonmin.solve(problem, plan, Deadline::after(std::chrono::milliseconds(1)));
  EXPECT_EQ(report.status, Status::deadline_reached);
  EXPECT_LE(report.cost, before);
  problem.initial[0] = std::nan("");
  EXPECT_EQ(bonmin.solve(problem, plan, Deadline::never()).status, Status::numerical_failure);
}

TEST(Bonmin, WithoutItTheSolverSaysWhatToInstall) {
  const auto problem = fishing_problem(0.1, {20, 20});
  BonminSolver<Fishing> bonmin;
  if (minlp::available()) {
    EXPECT_NO_THROW(bonmin.prepare(problem));
    return;
  }
  try {
    bonmin.prepare(problem);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("coinor-libbonmin-dev"), std::string::npos);
  }
}

}  // namespace
}  // namespace solenoid
