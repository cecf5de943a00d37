// Searches on the free-flyer with eight thrusters: least fuel from rest to rest against its closed form, and branch and
// bound against enumeration, to the last bit.
#include "core/systems/thrusters/bang_off_bang.hpp"
#include "core/systems/thrusters/modes.hpp"
#include "solvers/relaxed/dual.hpp"
#include "solvers/search/branch_and_bound.hpp"
#include "solvers/search/exhaustive.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using FlyerProblem = Problem<FreeFlyer>;

constexpr double block_s = 0.1;  ///< ten steps of 10 ms, the shortest pulse of the platform

FreeFlyerParameters platform(double least_s, double delay_s = 0.0) {
  FreeFlyerParameters p;
  p.least_on_s = p.least_off_s = least_s;
  p.rise_delay_s = p.fall_delay_s = delay_s;
  return p;
}

/// From rest at the origin to rest at `target`: the fuel [kg] plus what it costs to miss, a gram for 0.3 mm or 0.3 mm/s.
FlyerProblem rest_to_rest(const FreeFlyerParameters& p, const char* modes, int blocks,
                          const StateOf<FreeFlyer>& target) {
  Cost<FreeFlyer> cost;
  cost.consumption = 1.0;
  cost.terminal.fill(1e4);
  FlyerProblem problem(FreeFlyer(p), thruster_modes(modes, p), {0.01, std::vector<int>(std::size_t(blocks), 10)}, cost);
  for (auto& r : problem.reference) r = target;
  return problem;
}

struct FlyerSolution {
  SolveReport report;
  Plan<FreeFlyer> plan;
  double fuel_kg = 0.0;
  StateOf<FreeFlyer> end{};
};

template <class Search>
FlyerSolution searched(const FlyerProblem& problem) {
  Search search;
  search.prepare(problem);
  FlyerSolution s{{}, Plan<FreeFlyer>(problem)};
  s.report = search.solve(problem, s.plan, Deadline::never());
  s.plan.outputs.resize(problem.reference.size());
  EXPECT_EQ(evaluate(problem, s.plan).cost, s.report.cost);  // to the last bit
  FlyerProblem fuel_alone = problem;
  fuel_alone.cost = {};
  fuel_alone.cost.consumption = 1.0;
  s.fuel_kg = evaluate(fuel_alone, s.plan).cost;
  s.end = s.plan.outputs.back();
  return s;
}

/// How many times mode `name` stands in a plan.
int count_of(const FlyerProblem& problem, const Plan<FreeFlyer>& plan, const std::string& name) {
  int n = 0;
  for (const int mode : plan.modes) n += problem.modes.modes()[static_cast<std::size_t>(mode)].name == name;
  return n;
}

double pair_acceleration(const FreeFlyerParameters& p) { return 2 * p.thrust_n / p.mass_kg; }

TEST(ThrusterSearch, LeastFuelIsTheClosedFormsWhereItSwitchesOnTheGrid) {
  // Burns of whole blocks, horizons up to 2 s, least times of 0.2 s as on the platform: within 1 % is asked, and it is
  // the same number.
  const FreeFlyerParameters p = platform(0.2);
  for (const auto& [blocks, burn] : {std::pair{8, 2}, {12, 2}, {12, 3}, {16, 4}, {20, 2}}) {
    const double a = pair_acceleration(p), duration = blocks * block_s, t1 = burn * block_s;
    const double d = a * t1 * (duration - t1);
    const BangOffBang oracle = bang_off_bang(d, a, duration);
    const FlyerProblem problem = rest_to_rest(p, "along_x", blocks, {d, 0, 0, 0, 0, 0});
    const FlyerSolution s = searched<BranchAndBound<FreeFlyer>>(problem);
    EXPECT_EQ(s.report.status, Status::optimal);
    EXPECT_NEAR(s.fuel_kg / oracle.fuel_kg(2 * p.flow_kg_per_s), 1.0, 1e-9) << blocks << ", " << burn;
    EXPECT_NEAR(s.end[FreeFlyer::position_x], d, 1e-12);
    EXPECT_NEAR(s.end[FreeFlyer::velocity_x], 0.0, 1e-12);
    for (int b = 0; b < blocks; ++b)  // +x, coast, -x
      EXPECT_EQ(s.plan.modes[static_cast<std::size_t>(b)], b < burn ? 1 : b >= blocks - burn ? 2 : 0);
  }
}

TEST(ThrusterSearch, LeastFuelBetweenGridPointsIsTheClosedFormsRoundedUpToTheGrid) {
  // k blocks of thrust each way move by m a h^2 for every whole m from k^2 to k (N - k): so the least k for an m is the
  // first with k (N - k) >= m, which is the closed form's burn over h, rounded up.
  const FreeFlyerParameters p = platform(0.0);
  constexpr int blocks = 10;
  const double a = pair_acceleration(p), flow = 2 * p.flow_kg_per_s;
  for (int m = 1; m <= blocks * blocks / 4; ++m) {
    const double d = m * a * block_s * block_s;
    const BangOffBang oracle = bang_off_bang(d, a, blocks * block_s + 1e-12);
    const FlyerSolution s = searched<BranchAndBound<FreeFlyer>>(rest_to_rest(p, "along_x", blocks, {d, 0, 0, 0, 0, 0}));
    EXPECT_EQ(s.report.status, Status::optimal);
    EXPECT_NEAR(s.end[FreeFlyer::position_x], d, 1e-12) << m;
    EXPECT_NEAR(s.end[FreeFlyer::velocity_x], 0.0, 1e-12) << m;
    EXPECT_GE(s.fuel_kg, oracle.fuel_kg(flow) - 1e-9) << m;
    EXPECT_NEAR(s.fuel_kg, 2 * flow * block_s * std::ceil(oracle.burn_s / block_s - 1e-6), 1e-9) << m;
  }
}

TEST(ThrusterSearch, AmongAllPairsItFindsTheClosedFormOfEachAxisAtAnyHeading) {
  const FreeFlyerParameters p = platform(0.2);
  const double t1 = 0.2, duration = 0.8, a = pair_acceleration(p), d = a * t1 * (duration - t1);
  const double fuel = bang_off_bang(d, a, duration).fuel_kg(2 * p.flow_kg_per_s);
  // A quarter turn ahead, the floor's +x is the body's -y.
  FlyerProblem problem = rest_to_rest(p, "pairs", 8, {d, 0, std::numbers::pi / 2, 0, 0, 0});
  problem.initial[FreeFlyer::angle] = std::numbers::pi / 2;
  FlyerSolution s = searched<BranchAndBound<FreeFlyer>>(problem);
  EXPECT_NEAR(s.fuel_kg / fuel, 1.0, 1e-9);
  EXPECT_EQ(count_of(problem, s.plan, "-y"), 2);
  EXPECT_EQ(count_of(problem, s.plan, "+y"), 2);
  // A turn from rest to rest is the same problem with the angular acceleration of a pair.
  const double alpha = 2 * p.thrust_n * p.lever_m / p.inertia_kg_m2, turned = alpha * t1 * (duration - t1);
  problem = rest_to_rest(p, "pairs", 8, {0, 0, turned, 0, 0, 0});
  s = searched<BranchAndBound<FreeFlyer>>(problem);
  EXPECT_NEAR(s.fuel_kg / bang_off_bang(turned, alpha, duration).fuel_kg(2 * p.flow_kg_per_s), 1.0, 1e-9);
  EXPECT_EQ(count_of(problem, s.plan, "+turn"), 2);
  EXPECT_EQ(count_of(problem, s.plan, "-turn"), 2);
  EXPECT_NEAR(s.end[FreeFlyer::angle], turned, 1e-12);
}

TEST(ThrusterSearch, AxesThatMoveTogetherCostTheSumOfTheirClosedForms) {
  // x and y at once, by the modes that push along both.
  const FreeFlyerParameters p = platform(0.1);
  const double t1 = 0.1, duration = 0.4, a = pair_acceleration(p), d = a * t1 * (duration - t1);
  const FlyerProblem problem = rest_to_rest(p, "combined", 4, {d, -d, 0, 0, 0, 0});
  const FlyerSolution s = searched<BranchAndBound<FreeFlyer>>(problem);
  EXPECT_NEAR(s.fuel_kg / (2 * bang_off_bang(d, a, duration).fuel_kg(2 * p.flow_kg_per_s)), 1.0, 1e-9);
  EXPECT_EQ(count_of(problem, s.plan, "+x -y"), 1);
  EXPECT_EQ(count_of(problem, s.plan, "-x +y"), 1);
  EXPECT_NEAR(s.end[0], d, 1e-12);
  EXPECT_NEAR(s.end[1], -d, 1e-12);
}

TEST(ThrusterSearch, EqualDelaysOfBothEdgesOnlyShiftTheManoeuvre) {
  const double t1 = 0.2, duration = 1.2;
  const FreeFlyerParameters p = platform(0.2, 0.02);
  const double a = pair_acceleration(p), d = a * t1 * (duration - t1);
  FlyerProblem problem = rest_to_rest(p, "along_x", 13, {d, 0, 0, 0, 0, 0});
  problem.horizon.blocks.back() = 2;  // until the last edge has come
  problem.reference.resize(static_cast<std::size_t>(problem.horizon.steps()));
  const FlyerSolution s = searched<BranchAndBound<FreeFlyer>>(problem);
  EXPECT_NEAR(s.fuel_kg / bang_off_bang(d, a, duration).fuel_kg(2 * p.flow_kg_per_s), 1.0, 1e-9);
  EXPECT_NEAR(s.end[0], d, 1e-12);
  EXPECT_NEAR(s.plan.outputs[1][FreeFlyer::velocity_x], 0.0, 0.0);  // nothing moves for 20 ms
  EXPECT_GT(s.plan.outputs[2][FreeFlyer::velocity_x], 0.0);
}

/// A random problem, turning and tumbling, with edges in flight and dwells that have begun.
FlyerProblem drawn_problem(std::mt19937_64& random, const char* modes, int blocks) {
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  const auto grid = [&](int most) { return 0.01 * static_cast<double>(random() % static_cast<unsigned>(most + 1)); };
  FreeFlyerParameters p = platform(grid(20), grid(3));
  p.external_force_x_n = uniform(-1, 1);
  p.external_torque_nm = uniform(-0.3, 0.3);
  Horizon horizon{0.01, {}};
  for (int b = 0; b < blocks; ++b) horizon.blocks.push_back(3 + static_cast<int>(random() % 12));
  Cost<FreeFlyer> cost;
  for (double& w : cost.tracking) w = random() % 2 ? uniform(0, 10) : 0.0;
  for (double& w : cost.terminal) w = uniform(0, 100);
  cost.consumption = random() % 2 ? uniform(0, 3) : 0.0;
  cost.switching = random() % 2 ? uniform(0, 0.003) : 0.0;
  Bounds<FreeFlyer> bounds;
  if (random() % 3 == 0) bounds.state_upper[FreeFlyer::rate] = uniform(0.3, 0.8);
  FlyerProblem problem(FreeFlyer(p), thruster_modes(modes, p), horizon, cost, bounds);
  problem.initial = {uniform(-0.1, 0.1), uniform(-0.1, 0.1), uniform(-9, 9),
                     uniform(-0.1, 0.1), uniform(-0.1, 0.1), uniform(-0.3, 0.3)};
  for (auto& r : problem.reference) r = {0, 0, problem.initial[2] + uniform(-0.2, 0.2), 0, 0, 0};
  const SwitchTiming timing(problem.modes, horizon.dt_s);
  const auto any_mode = [&] { return static_cast<int>(random() % static_cast<unsigned>(problem.modes.size())); };
  problem.lines = DelayLines(problem.modes.pattern(any_mode()));
  problem.lines.advance(100);
  problem.lines.command(problem.modes.pattern(any_mode()), timing);
  problem.lines.advance(static_cast<int>(random() % 15));
  return problem;
}

void expect_enumeration(std::mt19937_64& random, const char* modes, int blocks, int trials) {
  std::int64_t nodes = 0, all = 0;
  int moved = 0, held = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const FlyerProblem problem = drawn_problem(random, modes, blocks);
    const FlyerSolution found = searched<BranchAndBound<FreeFlyer>>(problem);
    const FlyerSolution oracle = searched<Exhaustive<FreeFlyer>>(problem);
    ASSERT_EQ(found.report.status, oracle.report.status) << modes << " " << trial;
    ASSERT_EQ(found.report.cost, oracle.report.cost) << modes << " " << trial;
    ASSERT_EQ(found.plan.modes, oracle.plan.modes) << modes << " " << trial;
    EXPECT_LE(found.report.bound, found.report.cost);
    nodes += found.report.nodes;
    all += oracle.report.nodes;
    const SwitchTiming timing(problem.modes, problem.horizon.dt_s);
    bool free = true;  // to command every mode at once
    for (const Mode& mode : problem.modes.modes()) free = free && problem.lines.may_command(mode.pattern, timing);
    held += !free;
    moved += found.report.switches > 0;
  }
  EXPECT_GT(moved, trials / 4);
  EXPECT_GT(held, trials / 5);
  EXPECT_LT(nodes, all) << modes;
}

TEST(ThrusterSearch, BranchAndBoundIsEnumerationToTheLastBit) {
  std::mt19937_64 random(11);
  expect_enumeration(random, "along_x", 6, 40);
  expect_enumeration(random, "pairs", 4, 40);
  expect_enumeration(random, "single", 4, 30);
  expect_enumeration(random, "combined", 3, 20);
}

/// The enclosures' bound finds the same plan with less than 1 / `times` of the nodes.
void expect_fewer_nodes_by_enclosures(const FlyerProblem& problem, int times) {
  BranchAndBound<FreeFlyer> with, without({.enclosure_steps = 0});
  with.prepare(problem);
  without.prepare(problem);
  Plan<FreeFlyer> a(problem), b(problem);
  const SolveReport bounded = with.solve(problem, a, Deadline::never());
  const SolveReport unbounded = without.solve(problem, b, Deadline::never());
  EXPECT_EQ(a.modes, b.modes);
  EXPECT_EQ(bounded.cost, unbounded.cost);
  EXPECT_LT(bounded.nodes, unbounded.nodes / times);
}

TEST(ThrusterSearch, TheTrackingBoundPrunesAStepOfThePosition) {
  const FreeFlyerParameters p = platform(0.0);
  FlyerProblem problem = rest_to_rest(p, "pairs", 6, {0.05, 0.02, 0.1, 0, 0, 0});
  problem.cost.tracking = {10, 10, 1, 1, 1, 0.1};
  problem.cost.terminal.fill(0.0);
  expect_fewer_nodes_by_enclosures(problem, 2);
}

TEST(ThrusterSearch, TheTerminalBoundPrunesManoeuvresFromRestToRest) {
  const FreeFlyerParameters p = platform(0.0);
  const double d = pair_acceleration(p) * block_s * block_s * 2 * (12 - 2);
  const FlyerProblem problem = rest_to_rest(p, "along_x", 12, {d, 0, 0, 0, 0, 0});
  expect_fewer_nodes_by_enclosures(problem, 10);
}

TEST(ThrusterModel, DualNumbersOfTheSolversDifferentiateItOverTurns) {
  using Number = Dual<2>;
  const FreeFlyer model;
  const Vector<double, 8> s{0, 0, 0, 1, 1, 0, 1, 0};
  const double dt = 0.1, h = 1e-5;
  for (const double angle : {0.3, -2.9, 7.4, 40.0}) {
    const auto stepped = [&](double at, double rate) {
      return model.step<double>({0, 0, at, 0.1, 0.2, rate}, s, {}, dt);
    };
    Vector<Number, 8> thrusters;
    for (std::size_t c = 0; c < 8; ++c) thrusters[c] = Number(s[c]);
    const Vector<Number, 6> x{0.0, 0.0, Number(angle, 0), 0.1, 0.2, Number(0.5, 1)};
    const Vector<Number, 6> next = model.step<Number>(x, thrusters, {}, dt);
    for (std::size_t k = 0; k < 6; ++k) {
      double derivatives[2];
      next[k].copy_derivatives(derivatives);
      EXPECT_EQ(next[k].value(), stepped(angle, 0.5)[k]);
      EXPECT_NEAR(derivatives[0], (stepped(angle + h, 0.5)[k] - stepped(angle - h, 0.5)[k]) / (2 * h), 1e-9);
      EXPECT_NEAR(derivatives[1], (stepped(angle, 0.5 + h)[k] - stepped(angle, 0.5 - h)[k]) / (2 * h), 1e-9);
    }
  }
}

}  // namespace
}  // namespace solenoid
