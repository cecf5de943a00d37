// The actuator with an identified force in the search: lanes against the scalar rollout, enclosures against simulated
// ways, branch and bound against enumeration.
#include "core/systems/actuator/residual_actuator.hpp"
#include "solvers/search/rollout_kernels.hpp"
#include "tests/support/recorded_problems.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace solenoid::test {
namespace {

using Model = ResidualActuator;

/// A plant with Stribeck friction and twice the Coulomb friction that is believed, and gravity that is a little off.
Model frictional(const ActuatorParameters& parameters, const MotorGains& gains = {}) {
  ForceResidual residual;
  residual.velocity = HatSum(std::vector{-0.35, -0.3, -0.05, -0.01, -0.002, 0.0, 0.002, 0.01, 0.05, 0.3, 0.35},
                             std::vector{0.0, 3.0, 1.2, 1.0, 1.4, 0.0, -1.4, -1.0, -1.2, -3.0, 0.0});
  residual.position = HatSum(std::vector{0.0, 0.02, 0.08, 0.1}, std::vector{0.0, 0.3, -0.2, 0.0});
  return Model(parameters, gains, residual);
}

Problem<Model> frictional_problem(const std::vector<int>& periods) {
  auto problem = actuator_problem<Model>("two_way", periods, 2e-8);
  problem.model = frictional(problem.model.parameters(), problem.model.gains());
  return problem;
}

struct Draw {
  std::mt19937_64 random;
  double operator()(double low, double high) { return std::uniform_real_distribution(low, high)(random); }
};

TEST(ResidualKernels, RollEveryLaneAsTheScalarRolloutToTheLastBit) {
  auto problem = frictional_problem({8});
  Draw uniform{std::mt19937_64(7)};
  for (auto& r : problem.reference) r = {uniform(0, 0.1), uniform(-0.2, 0.2)};
  for (auto& r : problem.setpoint) r = {uniform(0, 0.1), uniform(-0.2, 0.2)};
  const std::vector<ContinuousOf<Model>> planned(problem.reference.size());
  Lanes<Model> start;
  LaneInputs<Model> inputs;
  inputs.reserve(1);
  inputs.pieces = 1;
  inputs.begin = {0};
  for (std::size_t lane = 0; lane < max_lanes; ++lane) {
    const std::array<double, 4> x = {uniform(-0.0065, 0.1205), lane % 5 == 0 ? 0.0 : uniform(-0.4, 0.4),
                                     uniform(9e4, 3e5), uniform(9e4, 3e5)};
    for (std::size_t i = 0; i < 4; ++i) start.state[i][lane] = x[i];
    start.cost[lane] = 0.0;
    for (std::size_t k = 0; k < 4; ++k) inputs.piece[0].value[k][lane] = uniform(0, 1);
  }
  for (const auto& kernel : runnable_kernels<Model>()) {
    Lanes<Model> lanes = start;
    lanes.count = max_lanes;
    kernel.roll(problem, {planned.data(), 0, 40, Bounds<Model>::infinity}, inputs, lanes);
    for (std::size_t lane = 0; lane < max_lanes; ++lane) {
      StateOf<Model> x;
      SwitchedOf<Model> s;
      for (std::size_t i = 0; i < 4; ++i) x[i] = start.state[i][lane], s[i] = inputs.piece[0].value[i][lane];
      double cost = 0.0;
      for (std::size_t j = 0; j < 40; ++j) roll_step<Model, double>(problem, j, s, planned[j], x, cost);
      EXPECT_EQ(lanes.cost[lane], cost) << kernel.architecture << " lane " << lane;
      for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(lanes.state[i][lane], x[i]) << kernel.architecture;
    }
  }
}

TEST(ResidualEnclosure, HoldsEverySimulatedWay) {
  const Model model = frictional({});
  Draw uniform{std::mt19937_64(11)};
  for (int trial = 0; trial < 200; ++trial) {
    StateOf<Model> x = {uniform(-0.006, 0.12), trial % 5 ? uniform(-0.5, 0.5) : 0.0, uniform(5e4, 3e5),
                        uniform(5e4, 3e5)};
    StateOf<Model> low = x, high = x;
    SwitchedOf<Model> opening{};
    for (int j = 0; j < 60; ++j) {
      if (j % (1 + trial % 9) == 0)
        for (double& o : opening) o = std::floor(uniform(0, 2));
      const OutputOf<Model> setpoint = {uniform(0, 0.1), uniform(-0.3, 0.3)};
      x = model.step<double>(x, opening, model.feedback<double>(x, setpoint), 0.001);
      model.enclose_step<double>(low, high, {0, 0, 0, 0}, {1, 1, 1, 1}, setpoint, {}, 0.001);
      for (std::size_t i = 0; i < 4; ++i) {
        const double margin = 1e-12 * (std::abs(low[i]) + std::abs(high[i]));
        ASSERT_LE(low[i] - margin, x[i]) << "state " << i << " trial " << trial << " step " << j;
        ASSERT_GE(high[i] + margin, x[i]) << "state " << i << " trial " << trial << " step " << j;
      }
    }
  }
}

TEST(ResidualSearch, BranchAndBoundFindsWhatEnumerationFinds) {
  auto problem = frictional_problem({1, 1, 6});
  problem.cost.terminal = {30.0, 0.02};
  BranchAndBound<Model> pruned, all({.prune = false});
  pruned.prepare(problem);
  all.prepare(problem);
  Draw uniform{std::mt19937_64(13)};
  for (int trial = 0; trial < 40; ++trial) {
    problem.initial = {uniform(0.01, 0.1), trial % 4 ? uniform(-0.3, 0.3) : 0.0, uniform(1e5, 2.5e5),
                       uniform(1e5, 2.5e5)};
    const double target = problem.initial[position] + uniform(-0.004, 0.004);
    for (auto& r : problem.reference) r = {target, 0.0};
    for (auto& r : problem.setpoint) r = {target, 0.0};
    Plan<Model> a(problem), b(problem);
    const SolveReport found = pruned.solve(problem, a, Deadline::never());
    const SolveReport oracle = all.solve(problem, b, Deadline::never());
    ASSERT_EQ(found.status, Status::optimal);
    ASSERT_EQ(found.cost, oracle.cost) << trial;
  }
}

}  // namespace
}  // namespace solenoid::test
