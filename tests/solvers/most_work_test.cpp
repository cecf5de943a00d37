// The most work of a tree search: against a search that really does it, a loop that counts it, and random problems.
#include "core/systems/actuator/prestabilised.hpp"
#include "core/systems/actuator/valves.hpp"
#include "solvers/search/branch_and_bound.hpp"
#include "solvers/search/exhaustive.hpp"
#include "tests/support/double_integrator.hpp"
#include "tests/support/inverter_problems.hpp"
#include "tests/support/uniform.hpp"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using Hybrid = PrestabilisedActuator;

Problem<Hybrid> hybrid_problem(const char* valves, std::vector<int> blocks, double switching) {
  const ActuatorParameters p;
  Cost<Hybrid> cost;
  cost.tracking = {1.0, 0.0};
  cost.switching = switching;
  return {Hybrid(p), valve_modes(valves, p), {0.001, std::move(blocks)}, cost};
}

/// A legal history of commands, the last of them under way.
DelayLines random_lines(const ModeSet& modes, double dt, std::mt19937_64& random) {
  const SwitchTiming timing(modes, dt);
  const auto some_pattern = [&] { return modes.pattern(static_cast<int>(random() % std::size_t(modes.size()))); };
  DelayLines lines(some_pattern());
  for (int i = 0; i < 4; ++i) {
    const SwitchPattern pattern = some_pattern();
    if (lines.may_command(pattern, timing)) lines.command(pattern, timing);
    lines.advance(1 + static_cast<int>(random() % 6));
  }
  return lines;
}

void pose_anything(Problem<Hybrid>& problem, Plan<Hybrid>& plan, std::mt19937_64& random) {
  problem.initial = {uniform(random, -0.006, 0.12), uniform(random, -1.0, 1.0), uniform(random, 1e5, 2.5e5),
                     uniform(random, 1e5, 2.5e5)};
  problem.lines = random_lines(problem.modes, problem.horizon.dt_s, random);
  // Every other reference is out of reach.
  const double from = uniform(random, -0.006, 0.12), rate = uniform(random, -0.3, 0.3);
  const double off = random() % 2 == 0 ? 0.0 : uniform(random, -0.3, 0.3);
  for (std::size_t j = 0; j < problem.reference.size(); ++j) {
    problem.reference[j] = {from + off + rate * 0.001 * static_cast<double>(j), rate};
    problem.setpoint[j] = {from + rate * 0.001 * static_cast<double>(j), rate};
  }
  for (int& mode : plan.modes) mode = static_cast<int>(random() % std::size_t(problem.modes.size()));
}

/// What expand() does to a whole tree, by another loop: lists of nodes, groups of as many parents as fill the lanes.
struct CountedTree {
  int modes, width;
  std::vector<int> blocks, bound_steps;
  SolveWork work{};

  static constexpr int first_lanes = 32;

  int whole_registers(int lanes) const { return (lanes + width - 1) / width * width; }
  void list(std::size_t level, int nodes, bool first_dive) {
    if (level == blocks.size()) return;
    for (int done = 0, fit = 0; done < nodes; done += fit, first_dive = false) {
      fit = std::max(1, (first_dive ? first_lanes : max_lanes) / modes);
      const int children = modes * std::min(fit, nodes - done);
      work.nodes += children;
      for (int from = 0; from < children; from += max_lanes) {
        const int lanes = whole_registers(std::min(max_lanes, children - from));
        work.model_steps += std::int64_t{lanes} * blocks[level];
        if (level + 1 < blocks.size()) work.bound_steps += std::int64_t{lanes} * bound_steps[level + 1];
      }
      list(level + 1, children, first_dive);
    }
  }
};

TEST(MostWork, IsTheWholeTreeThatALoopCountsForEveryNumberOfModesAndWidth) {
  for (const int width : {1, 2, 4, 8})
    for (const int count : {2, 3, 4, 5, 7, 9, 16, 27, 32, 33, 64, 200})
      for (const std::vector<int>& blocks : {std::vector<int>{20}, {4, 16}, {10, 10, 20}}) {
        std::vector<Switch> switches(8);
        std::vector<Mode> modes;
        modes.reserve(static_cast<std::size_t>(count));
        for (int m = 0; m < count; ++m) modes.push_back({"", static_cast<SwitchPattern>(m)});
        const ModeSet set("set", switches, modes, {0.0}, std::vector<std::vector<double>>(8, {1.0}));
        const std::vector<int> bound(blocks.size(), 3);
        CountedTree tree{count, width, blocks, bound};
        tree.list(0, 1, true);
        const MostWork most = most_tree_work(set, {.register_width = width,
                                                   .lanes = max_lanes,
                                                   .first_lanes = CountedTree::first_lanes,
                                                   .block_steps = blocks,
                                                   .bound_steps = bound});
        EXPECT_EQ(most.solve, tree.work) << count << " modes, registers of " << width << ": " << most.solve.model_steps;
      }
}

TEST(MostWork, IsWhatEnumerationAndASearchThatLeavesOutNothingReallyDo) {
  std::mt19937_64 random(1);
  for (const char* valves : {"three_way", "seven_mode", "two_way"}) {
    Problem<Hybrid> problem = hybrid_problem(valves, {10, 20, 30}, 2e-8);
    Plan<Hybrid> plan(problem);
    BranchAndBound<Hybrid> pruned, all({.prune = false});
    Exhaustive<Hybrid> scalar;
    for (Solver<Hybrid>* search : std::initializer_list<Solver<Hybrid>*>{&pruned, &all, &scalar}) {
      search->prepare(problem);
      ASSERT_TRUE(search->do_most_work(true));
      const auto most = search->most_work(problem);
      ASSERT_TRUE(most);
      pose_anything(problem, plan, random);
      const SolveReport report = search->solve(problem, plan, Deadline::never());
      EXPECT_EQ(report.work(), most->solve) << valves;
      EXPECT_EQ(report.status, Status::optimal);
      EXPECT_EQ(search == &pruned, most->solve.bound_steps > 0);
      EXPECT_TRUE(search == &all || most->late.within(most->solve));
      // Back again, it finds the same with less, or what it can but do.
      ASSERT_TRUE(search->do_most_work(false));
      const SolveReport again = search->solve(problem, plan, Deadline::never());
      EXPECT_EQ(again.cost, report.cost);
      EXPECT_TRUE(again.work().within(report.work()));
      const int incumbents = (2 + 2 * problem.modes.size()) * 3;
      EXPECT_EQ(search == &pruned, again.nodes < report.nodes - incumbents);
    }
  }
}

/// Solves random problems; returns the largest share of the most nodes.
double largest_share(Problem<Hybrid> problem, const TreeSearchSettings& settings, int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  BranchAndBound<Hybrid> search(settings);
  search.prepare(problem);
  const auto most = search.most_work(problem);
  Plan<Hybrid> plan(problem);
  double largest = 0.0;
  for (int i = 0; i < count; ++i) {
    pose_anything(problem, plan, random);
    const SolveReport report = search.solve(problem, plan, Deadline::never());
    EXPECT_TRUE(report.work().within(most->solve)) << report.nodes << " nodes, " << report.model_steps << " steps";
    largest = std::max(largest, static_cast<double>(report.nodes) / static_cast<double>(most->solve.nodes));
  }
  return largest;
}

TEST(MostWork, IsNeverExceededByRandomProblemsOfTheActuator) {
  for (const char* valves : {"three_way", "seven_mode", "two_way"}) {
    EXPECT_GT(largest_share(hybrid_problem(valves, {20, 80}, 0.0), {}, 100, 2), 0.3) << valves;
    largest_share(hybrid_problem(valves, {10, 10, 20}, 2e-8), {}, 40, 3);
    largest_share(hybrid_problem(valves, {3, 10, 20}, 2e-8), {.enclosure_steps = 100}, 40, 4);
    largest_share(hybrid_problem(valves, {2, 5, 5}, 0.0), {.prune = false}, 5, 5);
  }
}

TEST(MostWork, IsNeverExceededWhereDwellAndGroupsForbidChildren) {
  std::mt19937_64 random(6);
  // Two switches that may change one at a time and dwell, under way or not.
  const ModeSet modes("slow", {{"right", 0.2, 0.1, 0.3}, {"left", 0.2, 0.1, 0.3}},
                      {{"coast", 0}, {"right", 1}, {"left", 2}}, {0.0}, {{1.0}, {-1.0}}, {3});
  Problem<DoubleIntegrator> problem(DoubleIntegrator{}, modes, {0.1, {2, 3, 3, 4, 4}}, {.tracking = {1.0, 0.1}});
  Plan<DoubleIntegrator> plan(problem);
  for (const bool nothing_left_out : {false, true}) {
    BranchAndBound<DoubleIntegrator> search;
    search.prepare(problem);
    search.do_most_work(nothing_left_out);
    Exhaustive<DoubleIntegrator> scalar;
    scalar.prepare(problem);
    const MostWork most = *search.most_work(problem);
    // From coasting to either side and back, never across: 7 ways of two steps, not 9.
    EXPECT_EQ(most.solve.nodes, 3 + 7 + 17 + 41 + 99 + (2 + 2 * 3) * 5);
    std::int64_t largest = 0;
    for (int i = 0; i < 300; ++i) {
      problem.initial = {uniform(random, -3, 3), uniform(random, -2, 2)};
      problem.lines = random_lines(modes, 0.1, random);
      for (auto& r : problem.reference) r = {uniform(random, -3, 3), 0.0};
      const SolveReport report = search.solve(problem, plan, Deadline::never());
      EXPECT_TRUE(report.work().within(most.solve)) << report.nodes;
      EXPECT_TRUE(scalar.solve(problem, plan, Deadline::never()).work().within(scalar.most_work(problem)->solve));
      largest = std::max(largest, report.nodes);
    }
    EXPECT_LE(largest, most.solve.nodes);
    EXPECT_GT(largest, 30);
  }
}

TEST(MostWork, IsNeverExceededByTheInverterAndCountsItsNeighbours) {
  std::mt19937_64 random(7);
  Problem<InverterLoad> problem = test::inverter_problem(3, 600.0);
  Plan<InverterLoad> plan(problem);
  BranchAndBound<InverterLoad> search;
  search.prepare(problem);
  const MostWork most = *search.most_work(problem);
  // Of a phase of three levels 3, 7 and 17 ways of one, two and three steps begin at its middle.
  EXPECT_EQ(most.solve.nodes, 27 + 343 + 4913 + (2 + 2 * 27) * 3);
  for (int i = 0; i < 200; ++i) {
    test::pose_at_random(problem, random);
    EXPECT_TRUE(search.solve(problem, plan, Deadline::never()).work().within(most.solve));
  }
  search.do_most_work(true);
  problem.lines = DelayLines(problem.modes.pattern(0));
  for (int mode = 0; mode < problem.modes.size(); ++mode) {
    problem.lines = DelayLines(problem.modes.pattern(mode));
    EXPECT_TRUE(search.solve(problem, plan, Deadline::never()).work().within(most.solve));
  }
}

TEST(MostWork, AfterADeadlineIsDoneAndThePlanIsNoWorseThanHolding) {
  std::mt19937_64 random(8);
  Problem<Hybrid> problem = hybrid_problem("two_way", {10, 20, 30}, 2e-8);
  for (const bool prune : {true, false}) {
    BranchAndBound<Hybrid> search({.prune = prune});
    search.prepare(problem);
    const MostWork most = *search.most_work(problem);
    Plan<Hybrid> plan(problem), hold(problem);
    for (int i = 0; i < 200; ++i) {
      pose_anything(problem, plan, random);
      std::ranges::fill(hold.modes, problem.modes.find(problem.lines.commanded()));
      const double held = evaluate(problem, hold).cost;
      const bool begins = i % 2 == 0;
      const SolveReport report =
          search.solve(problem, plan, begins ? Deadline(Deadline::Clock::now()) : Deadline::after_s(1e-6 * (i % 40)));
      EXPECT_LE(report.cost, held);
      EXPECT_EQ(report.cost, evaluate(problem, plan).cost);
      EXPECT_LE(report.bound, report.cost);
      if (begins) {
        EXPECT_EQ(report.status, Status::deadline_reached);
        EXPECT_EQ(report.nodes, 2 * 3);
        EXPECT_TRUE(report.work().within(most.late));
      }
    }
  }
}

TEST(MostWork, StaysAtTheLargestNumberWhereNoneIsLargeEnough) {
  Problem<Hybrid> problem = hybrid_problem("two_way", std::vector<int>(32, 5), 0.0);
  const MostWork most = *BranchAndBound<Hybrid>().most_work(problem);
  EXPECT_EQ(most.solve.nodes, std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(most.solve.model_steps, std::numeric_limits<std::int64_t>::max());
  EXPECT_LE(most.late.model_steps, 24 * 5 * 32);
}

}  // namespace
}  // namespace solenoid
