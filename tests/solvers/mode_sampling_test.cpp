#include "solvers/sampling/mode_sampling.hpp"

#include "solvers/search/exhaustive.hpp"
#include "tests/support/double_integrator.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using SampledProblem = Problem<DoubleIntegrator>;
using SampledPlan = Plan<DoubleIntegrator>;

/// Random weights, delays, dwells, windows, bounds, edges in flight.
SampledProblem drawn_problem(int trial, std::mt19937_64& random) {
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  const auto steps = [&](int most) { return 0.1 * static_cast<double>(random() % static_cast<unsigned>(most + 1)); };
  Horizon horizon{0.1, {}};
  for (int b = 0; b < 2 + trial % 3; ++b) horizon.blocks.push_back(1 + static_cast<int>(random() % 5));
  Cost<DoubleIntegrator> cost{.tracking = {uniform(0, 1), uniform(0, 1)}, .terminal = {uniform(0, 5), uniform(0, 5)}};
  cost.switching = trial % 2 ? uniform(0, 0.3) : 0.0;
  cost.consumption = trial % 5 ? uniform(0, 0.3) : 0.0;
  Bounds<DoubleIntegrator> bounds;
  if (trial % 4 == 0) bounds.state_upper = {uniform(0.2, 2), uniform(0, 1)};
  ModeSet modes = bang_coast_bang(steps(4), steps(4), trial % 3 == 0 ? steps(4) : 0.0);
  if (trial % 7 == 0) {
    std::vector<Switch> limited(modes.switches().begin(), modes.switches().end());
    for (Switch& s : limited) s.max_changes = 2, s.window_s = 0.8;
    modes = modes.with_switches(limited);
  }
  SampledProblem problem(DoubleIntegrator{}, modes, horizon, cost, bounds);
  problem.initial = {uniform(-1, 1), uniform(-1, 1)};
  for (auto& r : problem.reference) r = {uniform(-1, 1), uniform(-1, 1)};
  const SwitchTiming timing(problem.modes, 0.1);
  for (int i = 0; i < 3; ++i) {
    problem.lines.command(problem.modes.pattern(static_cast<int>(random() % 3)), timing);
    problem.lines.advance(static_cast<int>(random() % 3));
  }
  return problem;
}

SampledPlan drawn_plan(const SampledProblem& problem, std::mt19937_64& random) {
  SampledPlan plan(problem);
  for (int& mode : plan.modes) mode = static_cast<int>(random() % 3);
  for (auto& u : plan.continuous) u = {0.1 * static_cast<double>(random() % 10)};
  return plan;
}

SolveReport sampled(const ModeSamplingSettings& settings, const SampledProblem& problem, SampledPlan& plan,
                    Deadline deadline = Deadline::never()) {
  ModeSampling<DoubleIntegrator> solver(settings);
  solver.prepare(problem);
  return solver.solve(problem, plan, deadline);
}

constexpr SamplingUpdate both_updates[] = {SamplingUpdate::elites, SamplingUpdate::weights};

TEST(CategoricalBlocks, EvenlySpacedBitsComeOutInTheProportionsAskedFor) {
  CategoricalBlocks blocks;
  blocks.prepare(2, 5);
  const std::vector<double> wanted = {0.5, 0.0, 0.25, 0.2, 0.05, 3.0, 3.0, 3.0, 0.0, 1.0};
  std::ranges::copy(wanted, blocks.probabilities().begin());
  blocks.tabulate();
  constexpr std::uint64_t draws = 1u << 20;
  for (std::size_t b = 0; b < 2; ++b) {
    std::vector<double> drawn(5);
    for (std::uint64_t i = 0; i < draws; ++i) drawn[static_cast<std::size_t>(blocks.draw(b, i << 44))] += 1.0 / draws;
    for (std::size_t m = 0; m < 5; ++m) EXPECT_NEAR(drawn[m], wanted[5 * b + m] / (b == 0 ? 1.0 : 10.0), 1e-5);
  }
  std::ranges::fill(blocks.row(0), 0.0);
  blocks.row(1)[2] = std::nan("");
  blocks.tabulate();
  for (const double p : blocks.probabilities()) EXPECT_EQ(p, 0.2) << "what is no distribution becomes uniform";
}

TEST(SequenceLanes, CostWhatEvaluateSaysToTheLastBit) {
  std::mt19937_64 random(3);
  int allowed = 0, broken = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const SampledProblem problem = drawn_problem(trial, random);
    SequenceLanes<DoubleIntegrator> lanes;
    lanes.prepare(problem);
    const SampledPlan inputs = drawn_plan(problem, random);
    std::vector<SampledPlan> plans(1 + trial % max_lanes, inputs);
    for (SampledPlan& plan : plans)
      for (int& mode : plan.modes) mode = static_cast<int>(random() % 3);
    lanes.start(problem, inputs);
    lanes.roll(problem, static_cast<int>(plans.size()), [&](int lane, std::size_t b, const DelayLines&) {
      return plans[static_cast<std::size_t>(lane)].modes[b];
    });
    for (std::size_t i = 0; i < plans.size(); ++i) {
      const SolveReport judged = evaluate(problem, plans[i]);
      EXPECT_EQ(lanes.cost(problem, static_cast<int>(i)), judged.cost) << trial;
      EXPECT_EQ(lanes.switches(static_cast<int>(i)), judged.switches);
      ++(judged.status == Status::feasible ? allowed : broken);
    }
  }
  EXPECT_GT(allowed, 1000);
  EXPECT_GT(broken, 500);
}

TEST(ModeSampling, IsNeverWorseThanItsWarmStartOrHoldingAndCostsWhatItSays) {
  std::mt19937_64 random(5);
  int better = 0, infeasible = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const SampledProblem problem = drawn_problem(trial, random);
    SampledPlan warm = drawn_plan(problem, random), hold = warm;
    std::ranges::fill(hold.modes, std::max(0, problem.modes.find(problem.lines.commanded())));
    const double start = std::min(evaluate(problem, warm).cost, evaluate(problem, hold).cost);
    for (const SamplingUpdate update : both_updates) {
      SampledPlan plan = warm;
      const SolveReport report = sampled({.update = update, .samples = 40, .iterations = 4}, problem, plan);
      if (!usable(report.status)) {
        EXPECT_EQ(report.status, Status::infeasible);
        EXPECT_EQ(plan.modes, hold.modes);
        ++infeasible;
        continue;
      }
      EXPECT_EQ(report.status, Status::feasible);
      const SolveReport judged = evaluate(problem, plan);
      EXPECT_EQ(judged.status, Status::feasible) << "dwells, windows and bounds are kept";
      EXPECT_EQ(judged.cost, report.cost);
      EXPECT_EQ(judged.switches, report.switches);
      EXPECT_LE(report.cost, start);
      EXPECT_LE(report.bound, report.cost);
      EXPECT_EQ(plan.continuous, warm.continuous);
      better += report.cost < start;
    }
  }
  EXPECT_GT(better, 200);
  EXPECT_GT(infeasible, 5);
}

TEST(ModeSampling, FindsTheOptimumWhereThereAreFewSequences) {
  std::mt19937_64 random(9);
  for (int trial = 0; trial < 100; ++trial) {
    const SampledProblem problem = drawn_problem(trial, random);  // at most 81
    SampledPlan optimal = drawn_plan(problem, random);
    const SampledPlan warm = optimal;
    Exhaustive<DoubleIntegrator> all;
    all.prepare(problem);
    const SolveReport best = all.solve(problem, optimal, Deadline::never());
    for (const SamplingUpdate update : both_updates) {
      SampledPlan plan = warm;
      const SolveReport report =
          sampled({.update = update, .samples = 8000, .iterations = 4, .mutation = 0.5}, problem, plan);
      EXPECT_EQ(report.cost, best.cost) << trial;
      EXPECT_EQ(report.status == Status::infeasible, best.status == Status::infeasible);
    }
  }
}

TEST(ModeSampling, TheSameProblemWarmStartAndSeedGiveTheSamePlanWhateverWasSolvedBefore) {
  std::mt19937_64 random(11);
  int different = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const SampledProblem problem = drawn_problem(trial, random);
    SampledProblem other = problem;
    other.initial = {0.3, -0.2};
    const SampledPlan warm = drawn_plan(problem, random);
    ModeSampling<DoubleIntegrator> solver({.samples = 12, .iterations = 2});
    solver.prepare(problem);
    SampledPlan first = warm, between = warm, again = warm, reseeded = warm;
    solver.solve(problem, first, Deadline::never());
    solver.solve(other, between, Deadline::never());
    solver.solve(problem, again, Deadline::never());
    EXPECT_EQ(first.modes, again.modes);
    EXPECT_EQ(first.relaxation.weights, again.relaxation.weights);
    sampled({.samples = 12, .iterations = 2, .seed = 2}, problem, reseeded);
    different += first.relaxation.weights != reseeded.relaxation.weights;
  }
  EXPECT_GT(different, 25);
}

TEST(ModeSampling, TheDistributionMovesToTheBestAndRidesInThePlan) {
  SampledProblem problem(DoubleIntegrator{}, bang_coast_bang(), {0.1, {4, 4, 4}}, {.tracking = {1.0, 0.0}});
  for (auto& r : problem.reference) r = {10.0, 0.0};  // right, and again right
  for (const SamplingUpdate update : both_updates) {
    SampledPlan plan(problem);
    const ModeSamplingSettings settings{.update = update,
                                        .samples = 2000,
                                        .iterations = 5,
                                        .elites = 0.02,
                                        .temperature = 1e-3,
                                        .smoothing = 0.1,
                                        .mutation = 0.0};
    sampled(settings, problem, plan);
    EXPECT_EQ(plan.modes, (std::vector<int>{1, 1, 1}));
    ASSERT_TRUE(plan.relaxation.known);
    for (std::size_t b = 0; b < 3; ++b) {
      EXPECT_GT(plan.relaxation.weights[3 * b + 1], 0.99);
      EXPECT_NEAR(
          plan.relaxation.weights[3 * b] + plan.relaxation.weights[3 * b + 1] + plan.relaxation.weights[3 * b + 2], 1.0,
          1e-12);
    }
    // From there it begins: after the only update that a second solve of two iterations makes, half has not been left over.
    SampledPlan next = plan;
    sampled({.update = update, .samples = 2, .iterations = 2, .smoothing = 1.0, .mutation = 0.0}, problem, next);
    for (std::size_t b = 0; b < 3; ++b)
      EXPECT_NEAR(next.relaxation.weights[3 * b + 1], 0.5 * plan.relaxation.weights[3 * b + 1] + 0.5 / 3, 1e-12);
  }
}

TEST(ModeSampling, DoesTheWorkThatItSaysItDoesAtMostAndOfALateSolveLess) {
  std::mt19937_64 random(17);
  for (int trial = 0; trial < 30; ++trial) {
    const SampledProblem problem = drawn_problem(trial, random);
    const SampledPlan warm = drawn_plan(problem, random);
    ModeSampling<DoubleIntegrator> solver({.samples = 1 + trial * 17, .iterations = 1 + trial % 5});
    const MostWork most = solver.most_work(problem).value();
    solver.prepare(problem);
    SampledPlan plan = warm, late = warm;
    EXPECT_EQ(solver.solve(problem, plan, Deadline::never()).work(), most.solve) << trial;
    const Deadline over(Deadline::Clock::now() - std::chrono::seconds(1));
    EXPECT_TRUE(solver.solve(problem, late, over).work().within(most.late));
  }
}

TEST(ModeSampling, KeepsWhatItHasAtADeadlineAndCallsAStateThatIsNoNumberAFailure) {
  std::mt19937_64 random(13);
  SampledProblem problem = drawn_problem(1, random);
  SampledPlan warm = drawn_plan(problem, random), plan = warm;
  const SolveReport report =
      sampled({.samples = 100000}, problem, plan, Deadline(Deadline::Clock::now() - std::chrono::seconds(1)));
  EXPECT_EQ(report.status, Status::deadline_reached);
  EXPECT_LE(evaluate(problem, plan).cost, evaluate(problem, warm).cost);
  problem.initial = {std::nan(""), 0.0};
  EXPECT_EQ(sampled({}, problem, plan).status, Status::numerical_failure);
}

}  // namespace
}  // namespace solenoid
