#include "solvers/rounding/relax_and_round.hpp"

#include "core/systems/actuator/prestabilised.hpp"
#include "core/systems/actuator/valves.hpp"
#include "solvers/search/exhaustive.hpp"
#include "tests/support/given_weights.hpp"
#include "tests/support/lotka_volterra.hpp"
#include "tests/support/uniform.hpp"

#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using Fishing = LotkaVolterraFishing;
using test::DrawnWeights;

Problem<Fishing> drawn_fishing(std::mt19937_64& random, double dwell_s = 0.0) {
  std::vector<int> blocks;
  for (int b = 0; b < 8; ++b) blocks.push_back(3 + static_cast<int>(random() % 20));
  auto problem = fishing_problem(0.05, blocks, uniform(random, 0.0, 0.02));
  problem.initial = {uniform(random, 0.3, 1.8), uniform(random, 0.3, 1.8)};
  if (dwell_s > 0.0)
    problem.modes = ModeSet("slow", {{"fleet", 0.0, 0.0, dwell_s}}, {{"ashore", 0}, {"fishing", 1}}, {0.0}, {{1.0}});
  return problem;
}

template <class M>
Problem<M> drawn_actuator(std::mt19937_64& random, const char* valves) {
  const ActuatorParameters p;
  Cost<M> cost;
  cost.tracking = {1.0, 0.0};
  cost.switching = 2e-8;
  cost.continuous = {1e-9};
  Bounds<M> bounds;
  bounds.continuous_lower = {-8.0};
  bounds.continuous_upper = {8.0};
  Problem<M> problem(M(p), valve_modes(valves, p), {0.001, {10, 10, 20, 60}}, cost, bounds);
  problem.initial = {uniform(random, 0.02, 0.09), uniform(random, -0.2, 0.2), uniform(random, 1.1e5, 2.2e5),
                     uniform(random, 1.1e5, 2.2e5)};
  for (auto& r : problem.reference) r = {uniform(random, 0.03, 0.08), 0.0};
  for (std::size_t j = 1; j < problem.reference.size(); ++j) problem.reference[j] = problem.reference[0];
  for (auto& r : problem.setpoint) r = problem.reference[0];
  return problem;
}

TEST(ModeSwaps, LeaveAPlanWithoutABetterNeighbour) {
  std::mt19937_64 random(1);
  int optimal = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const auto problem = drawn_fishing(random);
    Plan<Fishing> plan(problem);
    for (int& mode : plan.modes) mode = static_cast<int>(random() % 2);
    const double before = evaluate(problem, plan).cost;
    ModeSwaps<Fishing> swaps;
    swaps.prepare(problem);
    const SolveReport report = swaps.improve(problem, plan, Deadline::never());
    EXPECT_EQ(report.status, Status::feasible);
    EXPECT_EQ(report.cost, evaluate(problem, plan).cost);
    EXPECT_LE(report.cost, before);
    for (std::size_t b = 0; b < plan.modes.size(); ++b) {
      Plan<Fishing> other = plan;
      other.modes[b] = 1 - other.modes[b];
      EXPECT_GE(evaluate(problem, other).cost, report.cost) << trial << " block " << b;
    }
    Exhaustive<Fishing> all;
    all.prepare(problem);
    Plan<Fishing> best(problem);
    const double optimum = all.solve(problem, best, Deadline::never()).cost;
    EXPECT_LE(optimum, report.cost);
    optimal += report.cost == optimum;
  }
  EXPECT_GT(optimal, 20);
}

TEST(ModeSwaps, KeepDwellAndSwitchCountAndRepairPlansThatBreakThem) {
  std::mt19937_64 random(2);
  int repaired = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const auto problem = drawn_fishing(random, 0.9);
    Plan<Fishing> plan(problem);
    for (int& mode : plan.modes) mode = static_cast<int>(random() % 2);
    const SolveReport before = evaluate(problem, plan);
    ModeSwaps<Fishing> swaps({.max_switches = 3});
    swaps.prepare(problem);
    const SolveReport report = swaps.improve(problem, plan, Deadline::never());
    const bool kept = before.status == Status::feasible && before.switches <= 3;
    EXPECT_TRUE(!kept || report.cost <= before.cost);
    if (report.status == Status::feasible && report.switches <= 3) repaired += !kept;
    EXPECT_TRUE(!kept || report.switches <= 3);
  }
  EXPECT_GT(repaired, 5);
}

TEST(ModeSwaps, StopAtTheDeadlineWithAPlanNoWorse) {
  std::mt19937_64 random(3);
  const auto problem = drawn_fishing(random);
  Plan<Fishing> plan(problem);
  const double before = evaluate(problem, plan).cost;
  ModeSwaps<Fishing> swaps;
  swaps.prepare(problem);
  const SolveReport report = swaps.improve(problem, plan, Deadline(Deadline::Clock::now()));
  EXPECT_EQ(report.status, Status::deadline_reached);
  EXPECT_LE(report.cost, before);
  ModeSwaps<Fishing> one({.most_sweeps = 0});
  one.prepare(problem);
  EXPECT_EQ(one.improve(problem, plan, Deadline::never()).status, Status::iteration_limit);
}

template <class M>
void expect_stationary(const char* valves, unsigned seed) {
  std::mt19937_64 random(seed);
  int inside = 0, at_bounds = 0;
  for (int trial = 0; trial < 20; ++trial) {
    auto problem = drawn_actuator<M>(random, valves);
    problem.cost.continuous = {1e-7};
    Plan<M> plan(problem);
    for (int& mode : plan.modes) mode = static_cast<int>(random() % static_cast<unsigned>(problem.modes.size()));
    const double before = evaluate(problem, plan).cost;
    ContinuousRefinement<M> refinement({.most_iterations = 60, .tolerance = 1e-12});
    refinement.prepare(problem);
    const SolveReport report = refinement.refine(problem, plan, Deadline::never());
    EXPECT_LE(report.cost, before);
    EXPECT_EQ(report.cost, evaluate(problem, plan).cost);
    for (std::size_t b = 0; b < plan.modes.size(); ++b) {
      const double u = plan.continuous[b][0];
      EXPECT_GE(u, -8.0);
      EXPECT_LE(u, 8.0);
      (u > -8.0 && u < 8.0 ? inside : at_bounds) += 1;
      for (const double step : {-0.3, 0.3}) {  // friction's kinks may stop it a little before
        Plan<M> other = plan;
        other.continuous[b][0] = std::clamp(u + step, -8.0, 8.0);
        EXPECT_GE(evaluate(problem, other).cost, report.cost * (1 - 2e-3)) << trial << " block " << b << " u " << u;
      }
    }
  }
  EXPECT_GT(inside, 3);
  EXPECT_GT(at_bounds, 3);
}

TEST(ContinuousRefinement, FindsTheBestMotorForceForTheModes) {
  expect_stationary<PneumaticActuator>("three_way", 1);
  expect_stationary<PneumaticActuator>("two_way", 2);
}

template <class M>
RelaxAndRound<M> prepared(const Problem<M>& problem, unsigned seed, RelaxAndRoundSettings settings,
                          Status relaxed = Status::feasible) {
  RelaxAndRound<M> solver(std::make_unique<DrawnWeights<M>>(seed, relaxed), settings);
  solver.prepare(problem);
  return solver;
}

TEST(RelaxAndRound, CostsWhatItSaysAndNoMoreThanItsStartsAndItsRounding) {
  std::mt19937_64 random(4);
  for (int trial = 0; trial < 60; ++trial) {
    auto problem = drawn_actuator<PneumaticActuator>(random, trial % 2 ? "three_way" : "two_way");
    Plan<PneumaticActuator> warm(problem);
    for (int& mode : warm.modes) mode = static_cast<int>(random() % static_cast<unsigned>(problem.modes.size()));
    Plan<PneumaticActuator> hold = warm;
    std::fill(hold.modes.begin(), hold.modes.end(), 0);
    const auto method = trial % 3 ? RoundingMethod::sum_up : RoundingMethod::integral_approximation;
    auto solver = prepared(problem, static_cast<unsigned>(trial), {.method = method});
    Plan<PneumaticActuator> plan = warm;
    const SolveReport report = solver.solve(problem, plan, Deadline::never());
    EXPECT_EQ(report.status, Status::feasible);
    EXPECT_EQ(report.cost, evaluate(problem, plan).cost);
    EXPECT_LE(report.cost, evaluate(problem, warm).cost);
    EXPECT_LE(report.cost, evaluate(problem, hold).cost);
    EXPECT_LE(report.cost, solver.trace().rounded_cost);
    EXPECT_LE(report.bound, report.cost);
    EXPECT_GE(solver.trace().gap, method == RoundingMethod::sum_up ? 0.0 : solver.trace().gap_bound);
    Plan<PneumaticActuator> again = warm;
    auto twin = prepared(problem, static_cast<unsigned>(trial), {.method = method});
    twin.solve(problem, again, Deadline::never());
    EXPECT_EQ(plan.modes, again.modes);
  }
}

TEST(RelaxAndRound, PlainRoundingIsTheWeightsRounded) {
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 30; ++trial) {
    const auto problem = drawn_fishing(random);
    auto solver = prepared(problem, static_cast<unsigned>(trial), {.improve = false, .keep_start = false});
    Plan<Fishing> plan(problem);
    const SolveReport report = solver.solve(problem, plan, Deadline::never());
    ModeWeights weights(2, {problem.horizon.blocks.begin(), problem.horizon.blocks.end()});
    weights.weight = solver.relaxed_plan().weights;
    normalise(weights);
    std::vector<int> modes;
    const SumUpReport rounded = sum_up_rounding(weights, modes);
    EXPECT_EQ(plan.modes, modes);
    EXPECT_EQ(solver.trace().gap, rounded.gap);
    EXPECT_EQ(solver.trace().gap_bound, rounded.guarantee);
    EXPECT_EQ(report.cost, solver.trace().rounded_cost);
  }
}

TEST(RelaxAndRound, IntegralApproximationKeepsDwellWhereSumUpRoundingDoesNot) {
  std::mt19937_64 random(6);
  int broken = 0;
  for (int trial = 0; trial < 30; ++trial) {
    const auto problem = drawn_fishing(random, 0.8);
    const RelaxAndRoundSettings plain = {.improve = false, .keep_start = false};
    RelaxAndRoundSettings within = plain;
    within.method = RoundingMethod::integral_approximation;
    Plan<Fishing> plan(problem);
    auto cia = prepared(problem, static_cast<unsigned>(trial), within);
    EXPECT_EQ(cia.solve(problem, plan, Deadline::never()).status, Status::feasible);
    EXPECT_EQ(evaluate(problem, plan).status, Status::feasible);
    auto sum_up = prepared(problem, static_cast<unsigned>(trial), plain);
    const SolveReport report = sum_up.solve(problem, plan, Deadline::never());
    broken += report.status == Status::infeasible;
    EXPECT_TRUE(report.status == Status::infeasible || std::isfinite(report.cost));
  }
  EXPECT_GT(broken, 10);
}

TEST(RelaxAndRound, EveryStatus) {
  std::mt19937_64 random(7);
  auto problem = drawn_fishing(random);
  Plan<Fishing> plan(problem);
  auto solver = prepared(problem, 1, {});
  EXPECT_EQ(solver.solve(problem, plan, Deadline::never()).status, Status::feasible);
  EXPECT_EQ(solver.solve(problem, plan, Deadline(Deadline::Clock::now())).status, Status::deadline_reached);
  auto failing = prepared(problem, 1, {}, Status::numerical_failure);  // the relaxation fails: the starts remain
  EXPECT_EQ(failing.solve(problem, plan, Deadline::never()).status, Status::feasible);
  EXPECT_FALSE(std::isfinite(failing.trace().rounded_cost));
  auto alone = prepared(problem, 1, {.keep_start = false}, Status::numerical_failure);
  EXPECT_EQ(alone.solve(problem, plan, Deadline::never()).status, Status::infeasible);
  problem.bounds.state_upper = {0.1, 0.1};
  EXPECT_EQ(solver.solve(problem, plan, Deadline::never()).status, Status::infeasible);
  EXPECT_EQ(plan.modes, std::vector<int>(plan.modes.size(), 0));  // the mode in force held
  problem.bounds = {};
  problem.initial[0] = std::nan("");
  EXPECT_EQ(solver.solve(problem, plan, Deadline::never()).status, Status::numerical_failure);
}

}  // namespace
}  // namespace solenoid
