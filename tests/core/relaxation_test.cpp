// The relaxed problem contains the integer one: at integer points cost, outputs and switch timing agree.
#include "core/mpc/relaxation.hpp"

#include "core/systems/actuator/prestabilised.hpp"
#include "core/systems/actuator/valves.hpp"
#include "tests/support/lotka_volterra.hpp"
#include "tests/support/uniform.hpp"

#include <random>

#include <Eigen/Core>
#include <gtest/gtest.h>
#include <unsupported/Eigen/AutoDiff>

namespace solenoid {
namespace {

using Random = std::mt19937_64;

/// A problem of the actuator with random delays, weights, state and edges in flight.
template <class M>
Problem<M> drawn_problem(Random& random, const std::string& valves) {
  ActuatorParameters p;
  p.energise_delay_s = 0.001 * static_cast<double>(random() % 6);
  p.deenergise_delay_s = 0.001 * static_cast<double>(random() % 6);
  Horizon horizon{0.001, {5, 10, 5, 20}};
  Cost<M> cost;
  cost.tracking = {1.0, 0.1};
  cost.terminal = {3.0, 0.2};
  cost.switching = 1e-3;
  cost.consumption = 0.5;
  cost.continuous = {1e-6};
  Problem<M> problem(M(p), valve_modes(valves, p), horizon, cost);
  problem.initial = {uniform(random, 0.0, 0.1), uniform(random, -0.2, 0.2), uniform(random, 1.1e5, 2.4e5),
                     uniform(random, 1.1e5, 2.4e5)};
  const SwitchTiming timing(problem.modes, 0.001);
  for (int i = 0; i < 4; ++i) {
    problem.lines.command(
        problem.modes.pattern(static_cast<int>(random() % static_cast<unsigned>(problem.modes.size()))), timing);
    problem.lines.advance(5);  // a command a period, as controllers give them
  }
  for (auto& r : problem.reference) r = {uniform(random, 0.0, 0.1), 0.0};
  for (auto& r : problem.setpoint) r = {uniform(random, 0.0, 0.1), 0.0};
  return problem;
}

template <class M>
void expect_same_at_integer_points(const std::string& valves) {
  Random random(11);
  for (int trial = 0; trial < 60; ++trial) {
    auto problem = drawn_problem<M>(random, valves);
    Plan<M> plan(problem);
    for (int& mode : plan.modes) mode = static_cast<int>(random() % static_cast<unsigned>(problem.modes.size()));
    for (auto& u : plan.continuous) u[0] = uniform(random, -5.0, 5.0);
    plan.outputs.resize(problem.reference.size());
    const SolveReport exact = evaluate(problem, plan);
    for (const int period : {0, 5}) {
      const RelaxedGrid grid = control_grid(problem.horizon, period);
      check_grid(problem, grid);
      RelaxedPlan<M> relaxed(problem, grid);
      relax_plan(problem, grid, plan, relaxed);
      EXPECT_NEAR(relaxed_cost(problem, grid, relaxed), exact.cost, 1e-12 * exact.cost) << valves << " " << trial;
      for (std::size_t j = 0; j < plan.outputs.size(); ++j)
        ASSERT_NEAR(relaxed.outputs[j][0], plan.outputs[j][0], 1e-13) << valves << " " << trial << " step " << j;
    }
  }
}

TEST(Relaxation, IntegerPlansCostWhatTheyCost) {
  for (const std::string& valves : valve_configurations()) {
    expect_same_at_integer_points<PneumaticActuator>(valves);
    expect_same_at_integer_points<PrestabilisedActuator>(valves);
  }
}

TEST(Relaxation, StateInEffectIsMultilinearAndFollowsTheLines) {
  for (const auto& [rise, fall] : {std::pair{4, 1}, {1, 4}, {3, 3}, {0, 2}, {0, 0}}) {
    SwitchTiming timing;
    timing.switches = 1;
    timing.rise[0] = rise, timing.fall[0] = fall;
    for (const SwitchPattern before : {0u, 1u})
      for (const SwitchPattern after : {0u, 1u}) {
        DelayLines lines(before);
        lines.command(after, timing);
        for (int i = 0; i < 8; ++i)
          EXPECT_EQ(effective_state<double>(before, after, i, rise, fall), lines.effective(i)) << rise << fall << i;
      }
    for (int i = 0; i < 8; ++i)
      for (const double l : {0.2, 0.7}) {
        const auto at = [&, rise = rise, fall = fall](double c) {
          return effective_state<double>(l, c, i, rise, fall);
        };
        EXPECT_NEAR(at(0.3), 0.7 * at(0.0) + 0.3 * at(1.0), 1e-15);
        EXPECT_GE(at(0.3), 0.0);
        EXPECT_LE(at(0.3), 1.0);
      }
  }
}

TEST(Relaxation, SwitchChangeIsExactAtIntegersConvexAndBelow) {
  EXPECT_EQ(relaxed_switch_change(0.0), 0.0);
  EXPECT_NEAR(relaxed_switch_change(1.0), 1.0, 1e-15);
  EXPECT_NEAR(relaxed_switch_change(-1.0), 1.0, 1e-15);
  for (double d = -1.0; d <= 1.0; d += 0.01) {
    EXPECT_LE(relaxed_switch_change(d), std::abs(d) + 1e-15);
    EXPECT_GE(relaxed_switch_change(d), std::abs(d) - switching_roundness);
    EXPECT_GE(relaxed_switch_change(d - 0.01) + relaxed_switch_change(d + 0.01), 2 * relaxed_switch_change(d) - 1e-15);
  }
}

TEST(Relaxation, CostDifferentiatesThroughAnyScalar) {
  using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, 16, 1>>;
  auto problem = fishing_problem(0.1, std::vector<int>(8, 5), 0.01);
  const RelaxedGrid grid = control_grid(problem.horizon, 0);
  const SwitchTiming timing(problem.modes, problem.horizon.dt_s);
  Random random(3);
  std::vector<Dual> weights(16);
  std::vector<Vector<Dual, 0>> continuous(8);
  for (int i = 0; i < 16; ++i) weights[static_cast<std::size_t>(i)] = Dual(uniform(random, 0.2, 0.8), 16, i);
  const Dual cost =
      relaxed_cost<LotkaVolterraFishing, Dual>(problem, timing, grid, std::span<const Dual>(weights), continuous);
  RelaxedPlan<LotkaVolterraFishing> plan(problem, grid);
  for (std::size_t i = 0; i < 16; ++i) plan.weights[i] = weights[i].value();
  EXPECT_NEAR(relaxed_cost(problem, grid, plan), cost.value(), 1e-13);
  for (std::size_t i = 0; i < 16; ++i) {
    const auto moved = [&](double h) {
      RelaxedPlan<LotkaVolterraFishing> other = plan;
      other.weights[i] += h;
      return relaxed_cost(problem, grid, other);
    };
    EXPECT_NEAR((moved(1e-6) - moved(-1e-6)) / 2e-6, cost.derivatives()[static_cast<Eigen::Index>(i)], 1e-7) << i;
  }
}

TEST(Relaxation, GridsCutBlocksAndAreChecked) {
  EXPECT_EQ(control_grid({0.001, {5, 12}}, 5).intervals, (std::vector{5, 5, 5, 2}));
  EXPECT_EQ(control_grid({0.001, {5, 12}}, 0).intervals, (std::vector{5, 12}));
  const ActuatorParameters p;
  Problem<PneumaticActuator> problem(PneumaticActuator(p), valve_modes("two_way", p), {0.001, {10, 20}}, {});
  EXPECT_NO_THROW(check_grid(problem, {{10, 20}}));
  EXPECT_THROW(check_grid(problem, {{10, 10}}), std::invalid_argument);
  EXPECT_THROW(check_grid(problem, {{3, 27}}), std::invalid_argument);  // shorter than the 4 ms of a rising edge
}

TEST(Relaxation, RidesInThePlanAndIsShiftedWithIt) {
  const auto problem = fishing_problem(0.1, {5, 5, 5, 5});
  const RelaxedGrid grid = control_grid(problem.horizon, 0, 10);  // two blocks an interval
  ASSERT_EQ(grid.intervals, (std::vector{10, 10}));
  RelaxedPlan<LotkaVolterraFishing> relaxed(problem, grid), again(problem, grid);
  relaxed.row(0)[0] = 0.1, relaxed.row(0)[1] = 0.9;
  relaxed.row(1)[0] = 0.7, relaxed.row(1)[1] = 0.3;
  Plan<LotkaVolterraFishing> plan(problem);
  keep_relaxation(problem, grid, relaxed, plan);
  for (std::size_t b = 0; b < 4; ++b) plan.relaxation.owed[b][0] = static_cast<double>(b);
  relax_plan(problem, grid, plan, again);
  EXPECT_EQ(again.weights, relaxed.weights);
  shift_plan(problem.horizon, 5, plan);
  EXPECT_EQ(plan.relaxation.weights, (std::vector{0.1, 0.9, 0.7, 0.3, 0.7, 0.3, 0.7, 0.3}));
  EXPECT_EQ(plan.relaxation.owed.front()[0], 1.0);
  EXPECT_EQ(plan.relaxation.owed.back()[0], 3.0);  // the last block repeats
}

TEST(Relaxation, GridsJoinBlocksUntilNoneIsShorterThanTheLongestDelay) {
  EXPECT_EQ(control_grid({0.001, {5, 5, 10, 5}}, 0, 10).intervals, (std::vector{10, 15}));
  EXPECT_EQ(control_grid({0.001, std::vector<int>(11, 1)}, 0, 5).intervals, (std::vector{5, 6}));
  EXPECT_EQ(control_grid({0.001, {3}}, 0, 10).intervals, (std::vector{3}));
}

}  // namespace
}  // namespace solenoid
