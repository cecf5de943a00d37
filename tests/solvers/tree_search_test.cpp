#include "solvers/search/branch_and_bound.hpp"
#include "solvers/search/exhaustive.hpp"
#include "tests/support/double_integrator.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using Double = Problem<DoubleIntegrator>;

struct Solved {
  SolveReport report;
  Plan<DoubleIntegrator> plan;
};

/// Branch and bound without pruning: every sequence, a lane each.
struct LaneEnumeration {
  BranchAndBound<DoubleIntegrator> search{{.prune = false}};
  void prepare(const Double& problem) { search.prepare(problem); }
  SolveReport solve(const Double& problem, Plan<DoubleIntegrator>& plan, Deadline deadline) {
    return search.solve(problem, plan, deadline);
  }
};

/// The promises that every search over mode sequences keeps.
template <class Search>
class TreeSearch : public testing::Test {
 protected:
  static Solved solve(const Double& problem, Deadline deadline = Deadline::never()) {
    Search search;
    search.prepare(problem);
    Solved s{{}, Plan<DoubleIntegrator>(problem)};
    s.report = search.solve(problem, s.plan, deadline);
    return s;
  }
};
using Searches = testing::Types<Exhaustive<DoubleIntegrator>, BranchAndBound<DoubleIntegrator>, LaneEnumeration>;
TYPED_TEST_SUITE(TreeSearch, Searches);

struct Best {
  double cost = std::numeric_limits<double>::infinity();
  int switches = 0;
  std::vector<int> modes;
};

/// The cost of one sequence by a loop of its own: per step scheduled edges, sums in the order of theory.md, eq. 1.
/// Infinity where dwell or a bound is violated.
double naive_cost(const Double& p, const std::vector<int>& modes, int& switches) {
  const SwitchTiming timing(p.modes, p.horizon.dt_s);
  DelayLines lines = p.lines;
  StateOf<DoubleIntegrator> x = p.initial;
  double cost = 0;
  std::size_t j = 0;
  switches = 0;
  for (std::size_t b = 0; b < modes.size(); ++b) {
    const SwitchPattern wanted = p.modes.pattern(modes[b]);
    if (!lines.may_command(wanted, timing)) return std::numeric_limits<double>::infinity();
    int changes = 0;
    for (int c = 0; c < p.modes.switch_count(); ++c) changes += ((wanted ^ lines.commanded()) >> c) & 1u;
    switches += changes;
    cost += p.cost.switching * changes;
    lines.command(wanted, timing);
    for (int i = 0; i < p.horizon.blocks[b]; ++i, ++j) {
      const double force = p.modes.point(lines.effective())[0];
      if (p.cost.consumption != 0) cost += p.cost.consumption * p.horizon.dt_s * (force * force);
      x = p.model.step<double>(x, {force}, {0.0}, p.horizon.dt_s);
      for (std::size_t k = 0; k < 2; ++k) {
        const double error = p.reference[j][k] - x[k];
        cost += p.cost.tracking[k] * (error * error);
        if (x[k] < p.bounds.state_lower[k] || x[k] > p.bounds.state_upper[k])
          return std::numeric_limits<double>::infinity();
      }
      lines.advance(1);
    }
  }
  for (std::size_t k = 0; k < 2; ++k) {
    const double error = p.reference.back()[k] - x[k];
    cost += p.cost.terminal[k] * (error * error);
  }
  return cost;
}

/// Every sequence, counted up like a number; ties by switches, then by order.
Best enumerate(const Double& p) {
  Best best;
  std::vector<int> modes(p.horizon.blocks.size(), 0);
  for (;;) {
    int switches = 0;
    const double cost = naive_cost(p, modes, switches);
    if (cost < best.cost || (cost == best.cost && switches < best.switches && std::isfinite(cost)))
      best = {cost, switches, modes};
    std::size_t digit = modes.size();
    while (digit > 0 && modes[digit - 1] == p.modes.size() - 1) modes[--digit] = 0;
    if (digit == 0) return best;
    ++modes[digit - 1];
  }
}

TYPED_TEST(TreeSearch, FindsTheMinimumTimeSwitchOfTheDoubleIntegrator) {
  // From x0 = 1 the minimum time is 2 with the switch at 1: ten blocks of 0.2, five each way.
  Double problem(DoubleIntegrator{}, bang_bang(), {0.1, std::vector<int>(10, 2)}, {.terminal = {1.0, 1.0}});
  problem.initial = {1.0, 0.0};
  Solved s = this->solve(problem);
  s.plan.outputs.resize(problem.reference.size());
  evaluate(problem, s.plan);
  EXPECT_EQ(s.report.status, Status::optimal);
  EXPECT_EQ(s.plan.modes, (std::vector<int>{0, 0, 0, 0, 0, 1, 1, 1, 1, 1}));
  EXPECT_NEAR(s.report.cost, 0.0, 1e-28);
  EXPECT_EQ(s.report.switches, 1);
  EXPECT_NEAR(s.plan.outputs[9][0], 0.5, 1e-14);  // half way, at full speed
  EXPECT_NEAR(s.plan.outputs[9][1], -1.0, 1e-14);
  // A horizon shorter than the minimum time cannot reach the origin.
  Double shorter(DoubleIntegrator{}, bang_bang(), {0.1, std::vector<int>(9, 2)}, {.terminal = {1.0, 1.0}});
  shorter.initial = {1.0, 0.0};
  EXPECT_GT(this->solve(shorter).report.cost, 1e-3);
}

TYPED_TEST(TreeSearch, EqualsAnIndependentEnumerationOnRandomProblems) {
  std::mt19937_64 random(1);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  int feasible = 0, infeasible = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const auto delay = [&] { return 0.1 * std::floor(uniform(0, 5)); };
    const double dwell = trial % 3 == 0 ? delay() : 0.0;
    Horizon horizon{0.1, {}};
    for (int b = 0; b < 2 + trial % 4; ++b) horizon.blocks.push_back(1 + static_cast<int>(random() % 5));
    Cost<DoubleIntegrator> cost;
    cost.tracking = {uniform(0, 1), trial % 2 ? uniform(0, 1) : 0.0};
    cost.terminal = {uniform(0, 5), uniform(0, 5)};
    cost.switching = trial % 2 ? uniform(0, 0.3) : 0.0;
    cost.consumption = trial % 5 ? uniform(0, 0.3) : 0.0;
    Bounds<DoubleIntegrator> bounds;
    if (trial % 4 == 0) bounds.state_upper = {uniform(0.2, 2), uniform(0, 1)};
    Double problem(DoubleIntegrator{}, bang_coast_bang(delay(), delay(), dwell), horizon, cost, bounds);
    problem.initial = {uniform(-1, 1), uniform(-1, 1)};
    for (auto& r : problem.reference) r = {uniform(-1, 1), uniform(-1, 1)};
    const SwitchTiming timing(problem.modes, 0.1);
    for (int i = 0; i < 3; ++i) {  // edges in flight
      problem.lines.command(problem.modes.pattern(static_cast<int>(random() % 3)), timing);
      problem.lines.advance(static_cast<int>(random() % 3));
    }
    const Best best = enumerate(problem);
    Solved s = this->solve(problem);
    if (!std::isfinite(best.cost)) {
      ++infeasible;
      EXPECT_EQ(s.report.status, Status::infeasible);
      EXPECT_FALSE(usable(s.report.status));
      const int hold = problem.modes.find(problem.lines.commanded());
      EXPECT_EQ(s.plan.modes, std::vector<int>(horizon.blocks.size(), hold));
      continue;
    }
    ++feasible;
    EXPECT_EQ(s.report.status, Status::optimal) << trial;
    EXPECT_EQ(s.report.cost, best.cost) << trial;  // bit for bit
    EXPECT_EQ(s.report.bound, s.report.cost);
    EXPECT_EQ(s.report.switches, best.switches) << trial;
    EXPECT_EQ(s.plan.modes, best.modes) << trial;
    const SolveReport judged = evaluate(problem, s.plan);
    EXPECT_EQ(judged.cost, best.cost);
    EXPECT_EQ(judged.switches, best.switches);
  }
  EXPECT_GT(feasible, 200);
  EXPECT_GT(infeasible, 5);
}

TYPED_TEST(TreeSearch, BreaksTiesByFewestSwitchesThenLowestModes) {
  Double problem(DoubleIntegrator{}, bang_coast_bang(), {0.1, {2, 2, 2}}, {});  // no cost at all: everything ties
  problem.lines = DelayLines(1);
  EXPECT_EQ(this->solve(problem).plan.modes, (std::vector<int>{1, 1, 1}));  // hold: no switches
  EXPECT_EQ(this->solve(problem).report.switches, 0);
  // In force is a pattern no mode commands (both on): one change reaches `right` (1) or `left` (2); the lower wins.
  problem.lines = DelayLines(3);
  EXPECT_EQ(this->solve(problem).plan.modes, (std::vector<int>{1, 1, 1}));
  EXPECT_EQ(this->solve(problem).report.switches, 1);
}

TYPED_TEST(TreeSearch, CountsTheFirstChangeAgainstTheCommandInForce) {
  Double problem(DoubleIntegrator{}, bang_bang(), {0.1, {5}}, {.tracking = {1.0, 0.0}, .switching = 0.25});
  for (auto& r : problem.reference) r = {10.0, 0.0};
  const double from_left = this->solve(problem).report.cost;
  problem.lines = DelayLines(1);
  EXPECT_NEAR(from_left - this->solve(problem).report.cost, 0.25, 1e-12);
}

/// The best sequence that never changes both switches at once, by a check of its own of every sequence.
Best one_switch_at_a_time(const Double& p) {
  Double ungrouped(p.model, bang_coast_bang(), p.horizon, p.cost, p.bounds);
  ungrouped.initial = p.initial, ungrouped.reference = p.reference, ungrouped.lines = p.lines;
  Best best;
  std::vector<int> modes(p.horizon.blocks.size(), 0);
  for (;;) {
    int before = static_cast<int>(p.lines.commanded()), switches = 0;
    bool keeps = true;
    for (const int mode : modes) {
      keeps = keeps && !(before == 1 && mode == 2) && !(before == 2 && mode == 1) && !(before == 3 && mode == 0);
      before = mode;  // modes of bang_coast_bang are their patterns
    }
    const double cost = keeps ? naive_cost(ungrouped, modes, switches) : best.cost;
    if (keeps && (cost < best.cost || (cost == best.cost && switches < best.switches))) best = {cost, switches, modes};
    std::size_t digit = modes.size();
    while (digit > 0 && modes[digit - 1] == 2) modes[--digit] = 0;
    if (digit == 0) return best;
    ++modes[digit - 1];
  }
}

TYPED_TEST(TreeSearch, ChangesOneSwitchAtATimeOfAGroup) {
  std::mt19937_64 random(7);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  const ModeSet grouped("grouped", {{"right"}, {"left"}}, {{"coast", 0}, {"right", 1}, {"left", 2}}, {0.0},
                        {{1.0}, {-1.0}}, {0b11});
  int binding = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Cost<DoubleIntegrator> cost;
    cost.tracking = {uniform(0, 1), uniform(0, 1)};
    cost.switching = trial % 2 ? uniform(0, 0.05) : 0.0;
    Double problem(DoubleIntegrator{}, grouped, {0.1, std::vector<int>(1 + random() % 5, 3)}, cost);
    problem.initial = {uniform(-1, 1), uniform(-1, 1)};
    for (auto& r : problem.reference) r = {uniform(-1, 1), uniform(-1, 1)};
    problem.lines = DelayLines(static_cast<SwitchPattern>(random() % 4));
    const Best best = one_switch_at_a_time(problem);
    const Solved s = this->solve(problem);
    EXPECT_EQ(s.report.status, Status::optimal);
    EXPECT_EQ(s.report.cost, best.cost) << trial;  // bit for bit
    EXPECT_EQ(s.report.switches, best.switches) << trial;
    EXPECT_EQ(s.plan.modes, best.modes) << trial;
    problem.modes = bang_coast_bang();
    binding += this->solve(problem).report.cost < best.cost;
  }
  EXPECT_GT(binding, 20);
}

TYPED_TEST(TreeSearch, StopsAtADeadlineAlreadyPassedWithAUsableHold) {
  Double problem(DoubleIntegrator{}, bang_bang(), {0.1, {2, 2}}, {.terminal = {1.0, 0.0}});
  problem.lines = DelayLines(1);
  const Solved s = this->solve(problem, Deadline(Deadline::Clock::now() - std::chrono::seconds(1)));
  EXPECT_EQ(s.report.status, Status::deadline_reached);
  EXPECT_TRUE(usable(s.report.status));
  EXPECT_EQ(s.plan.modes, (std::vector<int>{1, 1}));
  Plan<DoubleIntegrator> plan = s.plan;
  EXPECT_LE(s.report.bound, evaluate(problem, plan).cost);
  EXPECT_GE(s.report.cost, evaluate(problem, plan).cost);
}

TYPED_TEST(TreeSearch, CallsANonFiniteStateANumericalFailure) {
  Double problem(DoubleIntegrator{}, bang_bang(), {0.1, {2, 2}}, {.terminal = {1.0, 0.0}});
  problem.initial = {std::nan(""), 0.0};
  EXPECT_EQ(this->solve(problem).report.status, Status::numerical_failure);
  // With bounds on the state too: a state that is no number is not an infeasible one.
  problem.bounds.state_upper = {5.0, 5.0};
  EXPECT_EQ(this->solve(problem).report.status, Status::numerical_failure);
}

TYPED_TEST(TreeSearch, RespectsDwellFromTheLastCommandOn) {
  Double problem(DoubleIntegrator{}, bang_bang(0, 0, 0.5), {0.1, {2, 2, 2, 2}}, {.tracking = {1.0, 0.0}});
  for (auto& r : problem.reference) r = {10.0, 0.0};
  const SwitchTiming timing(problem.modes, 0.1);
  problem.lines = DelayLines(1);
  problem.lines.advance(10);
  problem.lines.command(0, timing);  // just now: 5 steps must pass before `right` may return
  EXPECT_EQ(this->solve(problem).plan.modes, (std::vector<int>{0, 0, 0, 1}));
}

/// Three equal thrusters a way: 64 patterns, many of which push alike. A last block without the twins that change more is
/// still the enumeration's, mode for mode.
TEST(LeafModes, TwinsAreLeftOutOfLastBlocksAndTheOptimumStays) {
  std::mt19937_64 random(21);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  std::int64_t with = 0, without = 0;
  for (int trial = 0; trial < 60; ++trial) {
    std::vector<Switch> switches(6);
    for (std::size_t c = 0; c < 6; ++c) {
      switches[c].name = std::to_string(c);
      switches[c].rise_delay_s = trial % 2 ? 0.2 : 0.1 * static_cast<double>(random() % 3);
      switches[c].fall_delay_s = trial % 2 ? 0.1 : 0.1 * static_cast<double>(random() % 3);
    }
    std::vector<Mode> modes;
    for (SwitchPattern p = 0; p < 64; ++p) modes.push_back({std::to_string(p), p});
    const double third = 1.0 / 3;
    const ModeSet set("equal", switches, modes, {0.0}, {{third}, {third}, {third}, {-third}, {-third}, {-third}});
    Cost<DoubleIntegrator> cost{.tracking = {1.0, 0.1}, .terminal = {2.0, 1.0}};
    cost.switching = trial % 3 ? uniform(0, 0.05) : 0.0;
    Double problem(DoubleIntegrator{}, set, {0.1, {2, 3 + trial % 3}}, cost);
    problem.initial = {uniform(-1, 1), uniform(-1, 1)};
    problem.lines = DelayLines(static_cast<SwitchPattern>(random() % 64));
    for (auto& r : problem.reference) r = {uniform(-1, 1), 0.0};
    Exhaustive<DoubleIntegrator> all;
    BranchAndBound<DoubleIntegrator> search;
    all.prepare(problem);
    search.prepare(problem);
    Plan<DoubleIntegrator> a(problem), b(problem);
    const SolveReport full = all.solve(problem, a, Deadline::never());
    const SolveReport fast = search.solve(problem, b, Deadline::never());
    ASSERT_EQ(fast.status, Status::optimal);
    ASSERT_EQ(fast.cost, full.cost) << trial;
    ASSERT_EQ(fast.switches, full.switches) << trial;
    ASSERT_EQ(b.modes, a.modes) << trial;
    LeafModes twins;
    twins.prepare(set, SwitchTiming(set, 0.1));
    for (std::size_t row = 0; row < 64; ++row)
      for (int mode = 0; mode < 64; ++mode) {
        ++without;
        with += !twins.dominated(row, mode);
        if (mode == static_cast<int>(row)) {
          EXPECT_FALSE(twins.dominated(row, mode)) << "nothing switches alike with fewer changes than none";
        }
      }
  }
  EXPECT_LT(2 * with, without);
  LeafModes none;
  const ModeSet three = bang_coast_bang(0.1, 0.2, 0.0);
  none.prepare(three, SwitchTiming(three, 0.1));
  for (int mode = 0; mode < 3; ++mode) EXPECT_FALSE(none.dominated(1, mode));
}

}  // namespace
}  // namespace solenoid
