// Search on the actuator's own recorded states: kernels against the scalar rollout, branch and bound against
// enumeration, enclosures against simulated ways, deadlines.
#include "core/config/reader.hpp"
#include "solvers/search/exhaustive.hpp"
#include "solvers/search/rollout_kernels.hpp"
#include "tests/support/recorded_problems.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace solenoid::test {
namespace {

constexpr std::size_t one_in = SOLENOID_TEST_ONE_IN;  ///< of so many states a test takes one: more under sanitizers

/// The thesis's two motions; under sanitizers, where a search takes much longer, a short one.
std::vector<Trajectory> motions(double start_m) {
  if (one_in > 1) return {Trajectory(start_m).cycloid_to(0.1, 16.0 / one_in)};
  return {thesis_sine(start_m), thesis_cycloidal(start_m)};
}

template <class M>
std::vector<RecordedInstance<M>> recorded(const Problem<M>& problem, double kick) {
  BranchAndBound<M> search;
  std::vector<RecordedInstance<M>> all;
  for (const Trajectory& motion : motions(problem.model.parameters().equilibrium_position_m())) {
    const auto more = record_closed_loop(problem, motion, search, kick);
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

/// Every kernel the machine runs rolls each lane to the scalar rollout's state and cost, to the last bit.
template <class M>
void kernels_equal_scalar() {
  auto problem = actuator_problem<M>("two_way", {1, 3, 4}, 2e-8);
  problem.cost.consumption = 1e-3;
  problem.cost.tracking = {1.0, 1e-4};
  std::mt19937_64 random(7);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (auto& r : problem.reference) r = {uniform(0, 0.1), uniform(-0.2, 0.2)};
  for (auto& r : problem.setpoint) r = {uniform(0, 0.1), uniform(-0.2, 0.2)};
  std::vector<ContinuousOf<M>> planned(problem.reference.size());
  for (auto& u : planned) u = {uniform(-9, 9)};
  Lanes<M> start;
  LaneInputs<M> inputs;
  inputs.reserve(3);
  inputs.pieces = 3;
  inputs.begin = {0, 1, 4};
  for (std::size_t lane = 0; lane < max_lanes; ++lane) {
    const std::array<double, 4> x = {uniform(-0.0065, 0.1205), lane % 5 == 0 ? 0.0 : uniform(-1, 1), uniform(1e4, 4e5),
                                     uniform(1e4, 4e5)};
    for (std::size_t i = 0; i < 4; ++i) start.state[i][lane] = x[i];
    start.cost[lane] = uniform(0, 1e-6);
    for (std::size_t p = 0; p < 3; ++p)
      for (std::size_t k = 0; k < 4; ++k)
        inputs.piece[p].value[k][lane] = lane % 3 ? std::floor(uniform(0, 2)) : uniform(0, 1);
  }
  const auto kernels = runnable_kernels<M>();
  ASSERT_FALSE(kernels.empty());
  for (const auto& kernel : kernels)
    for (const int count : {kernel.width, 2 * kernel.width, max_lanes}) {
      if (count > max_lanes) continue;
      Lanes<M> lanes = start;
      lanes.count = count;
      kernel.roll(problem, {planned.data(), 2, 30, Bounds<M>::infinity}, inputs, lanes);
      for (std::size_t lane = 0; lane < static_cast<std::size_t>(count); ++lane) {
        StateOf<M> x;
        for (std::size_t i = 0; i < 4; ++i) x[i] = start.state[i][lane];
        double cost = start.cost[lane];
        for (std::size_t j = 0; j < 30; ++j) {
          const std::size_t p = j < 1 ? 0 : j < 4 ? 1 : 2;
          SwitchedOf<M> s;
          for (std::size_t k = 0; k < 4; ++k) s[k] = inputs.piece[p].value[k][lane];
          roll_step<M, double>(problem, j + 2, s, planned[j + 2], x, cost);
        }
        EXPECT_EQ(lanes.cost[lane], cost) << kernel.architecture << " lane " << lane << " of " << count;
        for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(lanes.state[i][lane], x[i]) << kernel.architecture;
      }
    }
}

TEST(RolloutKernels, RollEveryLaneAsTheScalarRolloutToTheLastBit) {
  kernels_equal_scalar<PneumaticActuator>();
  kernels_equal_scalar<PrestabilisedActuator>();
}

TEST(RolloutKernels, StopEarlyOnlyAboveTheCutoff) {
  auto problem = actuator_problem<PneumaticActuator>("two_way", {20});
  problem.reference.assign(100, {0.1, 0.0});  // 80 mm away: the cost passes any small cutoff at once
  std::vector<ContinuousOf<PneumaticActuator>> planned(100);
  LaneInputs<PneumaticActuator> inputs;
  inputs.reserve(1);
  inputs.pieces = 1;
  Lanes<PneumaticActuator> lanes{};
  lanes.count = max_lanes;
  for (std::size_t lane = 0; lane < max_lanes; ++lane) {
    lanes.state[0][lane] = 0.02;
    lanes.state[2][lane] = lanes.state[3][lane] = 101325.0;
  }
  rollout_kernel<PneumaticActuator>().roll(problem, {planned.data(), 0, 100, 1e-3}, inputs, lanes);
  for (const double cost : lanes.cost) {
    EXPECT_GT(cost, 1e-3);
    EXPECT_LT(cost, 0.1);  // a whole roll costs about 0.6
  }
}

template <class M>
void equal_to_enumeration(const std::string& valves, const std::vector<int>& periods, double switching, double kick,
                          std::size_t most, double dwell_s = 0.0, OutputOf<M> terminal = {}) {
  auto problem = actuator_problem<M>(valves, periods, switching);
  problem.cost.terminal = terminal;
  if (dwell_s > 0) {
    std::vector<Switch> switches(problem.modes.switches().begin(), problem.modes.switches().end());
    for (Switch& s : switches) s.min_dwell_s = dwell_s;
    const SwitchedPoint rest = problem.modes.point(0);
    std::vector<std::vector<double>> gain;
    for (std::size_t c = 0; c < switches.size(); ++c) {
      gain.emplace_back();
      for (std::size_t k = 0; k < 4; ++k) gain[c].push_back(problem.modes.point(1u << c)[k] - rest[k]);
    }
    problem.modes = ModeSet("dwelling", switches, {problem.modes.modes().begin(), problem.modes.modes().end()},
                            {rest.begin(), rest.end()}, gain);
  }
  const auto all = recorded(problem, kick);
  BranchAndBound<M> search, enumerate({.prune = false});
  search.prepare(problem);
  enumerate.prepare(problem);
  most /= one_in;
  const std::size_t stride = std::max<std::size_t>(1, all.size() / most);
  std::size_t compared = 0;
  for (std::size_t i = 0; i < all.size(); i += stride, ++compared) {
    all[i].pose(problem);
    Plan<M> found = all[i].warm_start, best(problem);
    const SolveReport fast = search.solve(problem, found, Deadline::never());
    const SolveReport full = enumerate.solve(problem, best, Deadline::never());
    ASSERT_EQ(fast.status, Status::optimal);
    ASSERT_EQ(fast.cost, full.cost) << valves << " instance " << i;
    ASSERT_EQ(found.modes, best.modes) << valves << " instance " << i;
    ASSERT_EQ(fast.bound, fast.cost);
    ASSERT_EQ(evaluate(problem, found).cost, fast.cost);
  }
  EXPECT_GE(compared, std::min(most, all.size()));
}

TEST(BranchAndBound, EqualsEnumerationOnRecordedStates) {
  equal_to_enumeration<PneumaticActuator>("three_way", {2, 2, 4, 12}, 0.0, 0.0, 1600);
  equal_to_enumeration<PneumaticActuator>("three_way", {2, 2, 4, 12}, 2e-8, 0.3, 1600);
  equal_to_enumeration<PrestabilisedActuator>("three_way", {2, 2, 4, 12}, 0.0, 0.3, 1600);
  equal_to_enumeration<PrestabilisedActuator>("two_way", {2, 4, 14}, 0.0, 0.0, 1600);
  equal_to_enumeration<PrestabilisedActuator>("two_way", {2, 4, 14}, 2e-8, 0.3, 1600);
  equal_to_enumeration<PneumaticActuator>("two_way", {2, 4, 14}, 2e-8, 0.3, 1600);
  equal_to_enumeration<PneumaticActuator>("seven_mode", {1, 3, 16}, 0.0, 0.3, 800);
}

TEST(BranchAndBound, EqualsEnumerationWithDwellLimits) {
  equal_to_enumeration<PneumaticActuator>("two_way", {1, 1, 2}, 0.0, 0.3, 800, 0.008);
  equal_to_enumeration<PrestabilisedActuator>("three_way", {1, 2, 2, 4}, 2e-8, 0.0, 800, 0.012);
}

TEST(BranchAndBound, EqualsEnumerationWithATerminalCost) {
  equal_to_enumeration<PrestabilisedActuator>("two_way", {1, 1, 6}, 2e-9, 0.3, 800, 0.0, {30.0, 0.02});
  equal_to_enumeration<PneumaticActuator>("three_way", {1, 1, 2, 4}, 0.0, 0.3, 800, 0.0, {0.0, 0.02});
}

TEST(BranchAndBound, EqualsEnumerationOfNineToTheFourth) {
  equal_to_enumeration<PrestabilisedActuator>("two_way", {2, 2, 4, 12}, 2e-8, 0.0, 1000);
}

TEST(BranchAndBound, EqualsEnumerationOfValveBanks) {
  equal_to_enumeration<PrestabilisedActuator>("pcm_2", {2, 6}, 1.2e-8, 0.3, 1000, 0.0, {30.0, 0.02});
  equal_to_enumeration<PneumaticActuator>("pcm_2", {2, 6}, 2e-8, 0.3, 1000);
  equal_to_enumeration<PrestabilisedActuator>("dual_orifice", {1, 2, 5}, 1.2e-8, 0.3, 1000, 0.0, {30.0, 0.02});
  equal_to_enumeration<PneumaticActuator>("dual_orifice", {1, 2, 5}, 2e-8, 0.3, 1000);
  equal_to_enumeration<PrestabilisedActuator>("pcm_3", {1, 7}, 1.2e-8, 0.3, 30, 0.0, {30.0, 0.02});
  equal_to_enumeration<PneumaticActuator>("pcm_4", {8}, 2e-8, 0.3, 100, 0.0, {30.0, 0.02});
}

TEST(LaneEnumeration, EqualsTheScalarSearchOnTheActuator) {
  auto problem = actuator_problem<PneumaticActuator>("two_way", {2, 18}, 2e-8);
  const auto all = recorded(problem, 0.3);
  Exhaustive<PneumaticActuator> scalar;
  BranchAndBound<PneumaticActuator> lanes({.prune = false});
  scalar.prepare(problem);
  lanes.prepare(problem);
  for (std::size_t i = 0; i < all.size(); i += 16) {
    all[i].pose(problem);
    Plan<PneumaticActuator> a(problem), b(problem);
    ASSERT_EQ(scalar.solve(problem, a, Deadline::never()).cost, lanes.solve(problem, b, Deadline::never()).cost);
    ASSERT_EQ(a.modes, b.modes);
  }
}

/// No simulated way from a state leaves the boxes that enclose_step derives from it.
template <class M>
void stays_enclosed(const ActuatorParameters& parameters, std::uint64_t seed) {
  const M model(parameters);
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (int trial = 0; trial < 400; ++trial) {
    StateOf<M> x = {trial % 4 ? uniform(-0.006, 0.12) : (trial % 8 ? -0.0064 : 0.1203), uniform(-0.8, 0.8),
                    uniform(5e4, 3e5), uniform(5e4, 3e5)};
    if (trial % 7 == 0) x[velocity] = 0.0;
    StateOf<M> low = x, high = x;
    std::array<double, 4> opening{};
    for (int j = 0; j < 60; ++j) {
      if (j % (1 + trial % 9) == 0)
        for (double& o : opening) o = std::floor(uniform(0, 2));
      const OutputOf<M> setpoint = {uniform(0, 0.1), uniform(-0.3, 0.3)};
      ContinuousOf<M> motor{};
      if constexpr (HasFeedback<M>) motor = model.template feedback<double>(x, setpoint);
      x = model.template step<double>(x, opening, motor, 0.001);
      model.template enclose_step<double>(low, high, {0, 0, 0, 0}, {1, 1, 1, 1}, setpoint, ContinuousOf<M>{}, 0.001);
      for (std::size_t i = 0; i < 4; ++i) {
        const double margin = 1e-12 * (std::abs(low[i]) + std::abs(high[i]));
        ASSERT_LE(low[i] - margin, x[i]) << "state " << i << " trial " << trial << " step " << j;
        ASSERT_GE(high[i] + margin, x[i]) << "state " << i << " trial " << trial << " step " << j;
      }
    }
  }
}

TEST(Enclosure, HoldsEverySimulatedWay) {
  for (const char* set : {"consistent", "printed", "printed+inferred+no_rod_atmosphere"}) {
    stays_enclosed<PneumaticActuator>(named_parameters(set), 1);
    stays_enclosed<PrestabilisedActuator>(named_parameters(set), 2);
  }
}

/// The bound of a box is below the cost of every way on from its node, terminal cost included, for every kernel and
/// however many lanes close before the others.
template <class M>
void bounded_by_enclosures(const OutputOf<M>& tracking, const OutputOf<M>& terminal, double cutoff,
                           std::uint64_t seed) {
  auto problem = actuator_problem<M>("two_way", {12});
  problem.cost.tracking = tracking;
  problem.cost.terminal = terminal;
  const int first = 10, steps = problem.horizon.steps();
  const SwitchTiming timing(problem.modes, problem.horizon.dt_s);
  LaneInputBuilder<M> builder;
  builder.prepare(problem.modes, timing);
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  const auto any_mode = [&] { return std::uniform_int_distribution(0, problem.modes.size() - 1)(random); };
  const std::vector<ContinuousOf<M>> planned(static_cast<std::size_t>(steps));
  std::size_t worth_something = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const double at = uniform(0.02, 0.08), rate = uniform(-0.2, 0.2);
    for (std::size_t j = 0; j < problem.reference.size(); ++j)
      problem.reference[j] = {at + rate * 0.001 * static_cast<double>(j), rate};
    if constexpr (HasFeedback<M>) problem.setpoint = problem.reference;
    std::vector<Rollout<M>> nodes;
    for (int lane = 0; lane < max_lanes; ++lane) {
      Rollout<M> node(problem);
      node.state = {at + uniform(-0.01, 0.01), uniform(-0.3, 0.3), uniform(1e5, 2.5e5), uniform(1e5, 2.5e5)};
      node.step = first;
      node.lines = DelayLines(problem.modes.pattern(any_mode()));
      nodes.push_back(node);
    }
    for (const auto& kernel : runnable_kernels<M>()) {
      LaneInputs<M> lowest, highest;
      lowest.reserve(builder.most_pieces()), highest.reserve(builder.most_pieces());
      builder.begin(0, lowest), builder.begin(0, highest);
      Boxes<M> boxes;
      boxes.count = max_lanes;
      for (int lane = 0; lane < max_lanes; ++lane) {
        const Rollout<M>& node = nodes[static_cast<std::size_t>(lane)];
        for (std::size_t i = 0; i < M::state_size; ++i) boxes.low[i][lane] = boxes.high[i][lane] = node.state[i];
        boxes.cost[lane] = node.cost;
        builder.hull(static_cast<std::size_t>(problem.modes.find(node.lines.commanded())), max_switches, lane, lowest,
                     highest);
      }
      kernel.enclose(problem, {planned.data(), first, steps - first, cutoff}, lowest, highest, boxes);
      for (int lane = 0; lane < max_lanes; ++lane) {
        worth_something += boxes.cost[lane] > 0.0;
        for (int way = 0; way < 4; ++way) {
          Rollout<M> on = nodes[static_cast<std::size_t>(lane)];
          while (on.step < steps)
            roll_block(problem, timing, any_mode(), std::min(steps - on.step, 1 + 7 * way), ContinuousOf<M>{}, on);
          ASSERT_LE(boxes.cost[lane], total_cost(problem, on)) << kernel.architecture << " lane " << lane;
        }
      }
    }
  }
  EXPECT_GT(worth_something, std::size_t{40 * max_lanes / 4});
}

TEST(Enclosure, BoundsTheCostOfEveryWayTerminalCostIncluded) {
  bounded_by_enclosures<PrestabilisedActuator>({1.0, 0.0}, {0.0, 0.0}, 1e-2, 3);
  bounded_by_enclosures<PrestabilisedActuator>({1.0, 0.0}, {30.0, 0.02}, 1e-3, 4);
  bounded_by_enclosures<PneumaticActuator>({0.0, 0.0}, {30.0, 0.02}, 1e-4, 5);
}

/// What a slide that cannot keep up costs falls into the far end of the horizon: a box dropped before sees half of it.
TEST(BranchAndBound, FollowsSaturatedStatesToTheEnd) {
  auto problem = actuator_problem<PrestabilisedActuator>("two_way", {2, 2, 4, 12}, 2e-8);
  const auto all = recorded(problem, 0.5);
  BranchAndBound<PrestabilisedActuator> to_the_end, dropped({.enclosure_steps = 30});
  to_the_end.prepare(problem);
  dropped.prepare(problem);
  std::int64_t with = 0, without = 0;
  for (std::size_t i = 0; i < all.size(); i += 5) {
    all[i].pose(problem);
    Plan<PrestabilisedActuator> plan = all[i].warm_start;
    const SolveReport full = dropped.solve(problem, plan, Deadline::never());
    if (full.nodes < 3000) continue;
    plan = all[i].warm_start;
    without += full.nodes;
    const SolveReport r = to_the_end.solve(problem, plan, Deadline::never());
    with += r.nodes;
    EXPECT_EQ(r.cost, full.cost);
  }
  EXPECT_LE(4 * with, without);
  EXPECT_GE(without, one_in > 1 ? 0 : 3000) << "no saturated state among those recorded";
}

TEST(BranchAndBound, KeepsItsPromisesAtEveryDeadline) {
  auto problem = actuator_problem<PrestabilisedActuator>("two_way", {1, 1, 2, 4, 12}, 2e-8);
  const auto all = recorded(problem, 0.3);
  BranchAndBound<PrestabilisedActuator> search;
  search.prepare(problem);
  std::size_t stopped = 0;
  for (std::size_t i = 0; i < all.size(); i += 20) {
    all[i].pose(problem);
    Plan<PrestabilisedActuator> exact = all[i].warm_start, hold(problem);
    const double optimum = search.solve(problem, exact, Deadline::never()).cost;
    hold.modes.assign(hold.modes.size(), std::max(0, problem.modes.find(problem.lines.commanded())));
    const double hold_cost = evaluate(problem, hold).cost;
    for (const int budget_us : {0, 20, 100}) {
      Plan<PrestabilisedActuator> plan = all[i].warm_start;
      const SolveReport r = search.solve(problem, plan, Deadline::after(std::chrono::microseconds(budget_us)));
      stopped += r.status == Status::deadline_reached;
      EXPECT_LE(r.bound, optimum);
      EXPECT_GE(r.cost, optimum);
      EXPECT_LE(r.cost, hold_cost);
      EXPECT_EQ(evaluate(problem, plan).cost, r.cost);
    }
  }
  EXPECT_GT(stopped, 20 / one_in);
}

}  // namespace
}  // namespace solenoid::test
