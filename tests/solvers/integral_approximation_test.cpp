#include "solvers/rounding/integral_approximation.hpp"

#include "solvers/rounding/sum_up_rounding.hpp"
#include "tests/support/random_weights.hpp"

#include <set>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

struct Rounded {
  ApproximationReport report;
  std::vector<int> modes;
};

Rounded approximate(const ModeWeights& weights, const SwitchLimits& limits,
                    const IntegralApproximationSettings& settings = {}, Deadline deadline = Deadline::never(),
                    std::vector<int> warm = {}) {
  IntegralApproximation search(settings);
  search.prepare(weights.intervals(), weights.modes, static_cast<int>(limits.switches.size()));
  if (warm.empty()) warm.assign(weights.intervals(), -1);
  Rounded rounded{{}, warm};
  rounded.report = search.solve(weights, limits, rounded.modes, deadline);
  return rounded;
}

/// The least gap over every sequence that keeps to the limits, by enumeration of all modes^intervals of them.
double enumerated(const ModeWeights& weights, const SwitchLimits& limits) {
  std::vector<int> modes(weights.intervals(), 0);
  double least = HUGE_VAL;
  for (;;) {
    if (walk_limits(limits, weights.dt, modes).allowed) least = std::min(least, integral_gap(weights, modes));
    std::size_t k = 0;
    while (k < modes.size() && ++modes[k] == weights.modes) modes[k++] = 0;
    if (k == modes.size()) return least;
  }
}

/// Limits of any kind: one switch a mode or shared ones, dwell times, change counts, a pattern in force or none.
SwitchLimits random_limits(std::mt19937_64& random, int modes, double dt) {
  std::uniform_real_distribution unit(0.0, 1.0);
  SwitchLimits limits = one_hot_limits(modes);
  if (random() % 2) {  // binary patterns over fewer switches
    const int switches = std::max(1, static_cast<int>(std::ceil(std::log2(modes))));
    limits.switches.resize(static_cast<std::size_t>(switches));
    for (int m = 0; m < modes; ++m) limits.patterns[static_cast<std::size_t>(m)] = static_cast<SwitchPattern>(m);
  }
  if (random() % 3) limits.in_force = limits.patterns[random() % limits.patterns.size()];
  if (random() % 3 == 0) limits.in_force = static_cast<std::int64_t>(random() % (1u << limits.switches.size()));
  if (random() % 3 == 0) limits.max_changes = static_cast<int>(random() % 7);
  if (random() % 3 == 0) limits.one_at_a_time = {static_cast<SwitchPattern>(random() % (1u << limits.switches.size()))};
  for (SwitchLimits::PerSwitch& s : limits.switches) {
    if (random() % 2) s.min_on = dt * static_cast<double>(random() % 4);
    if (random() % 2) s.min_off = 3.0 * dt * unit(random);
    if (random() % 4 == 0) s.max_changes = static_cast<int>(random() % 4);
    if (random() % 3 == 0) s.age = dt * static_cast<double>(random() % 3);
  }
  return limits;
}

TEST(IntegralApproximation, IsTheBestOfAllSequencesThatKeepToTheLimits) {
  std::mt19937_64 random(1);
  int infeasible = 0, limited = 0;
  for (int trial = 0; trial < 1500; ++trial) {
    const int modes = 2 + static_cast<int>(random() % 4),
              intervals = 1 + static_cast<int>(random() % (modes < 4 ? 8 : 6));
    const ModeWeights weights = test::random_weights(random, modes, intervals, trial % 2);
    const SwitchLimits limits = trial % 5 ? random_limits(random, modes, weights.dt[0]) : one_hot_limits(modes);
    const double truth = enumerated(weights, limits);
    IntegralApproximationSettings settings;
    settings.table_entries = trial % 3 ? std::size_t{1} << (trial % 7) : 0;
    const Rounded found = approximate(weights, limits, settings);
    if (!std::isfinite(truth)) {
      ++infeasible;
      EXPECT_EQ(found.report.status, Status::infeasible) << trial;
      continue;
    }
    ASSERT_EQ(found.report.status, Status::optimal) << trial;
    EXPECT_NEAR(found.report.cost, truth, 1e-12 * (1 + truth)) << trial;
    EXPECT_EQ(found.report.bound, found.report.cost);
    EXPECT_NEAR(integral_gap(weights, found.modes), found.report.cost, 1e-12) << trial;
    const LimitedWalk walk = walk_limits(limits, weights.dt, found.modes);
    EXPECT_TRUE(walk.allowed) << trial;
    EXPECT_EQ(walk.changes, found.report.changes);
    limited += truth > enumerated(weights, one_hot_limits(modes)) + 1e-9;
  }
  EXPECT_GE(infeasible, 5);
  EXPECT_GT(limited, 300);
}

TEST(IntegralApproximation, KeepsTijdemansBoundOnEqualIntervalsAndNeverDoesWorseThanSumUpRounding) {
  // Without limits some sequence stays within 1 - 1/(2 M - 2) intervals of any weights (Tijdeman 1980).
  std::mt19937_64 random(2);
  int better = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const int modes = 2 + static_cast<int>(random() % 4), intervals = 4 + static_cast<int>(random() % 20);
    const ModeWeights weights = test::random_weights(random, modes, intervals, false);
    std::vector<int> sum_up;
    const double gap = sum_up_rounding(weights, sum_up).gap;
    const Rounded found = approximate(weights, one_hot_limits(modes), {}, Deadline::never(), sum_up);
    ASSERT_EQ(found.report.status, Status::optimal) << trial;
    EXPECT_LE(found.report.cost, (1.0 - 1.0 / (2 * modes - 2)) * weights.dt[0] * (1 + 1e-12)) << trial;
    EXPECT_LE(found.report.cost, gap + 1e-12);
    better += found.report.cost < gap - 1e-9;
  }
  EXPECT_GT(better, 10);
}

TEST(IntegralApproximation, TheTableOfSearchedStatesSavesNodesAndChangesNothingElse) {
  for (const auto& [modes, intervals, changes] : {std::tuple{5, 24, SwitchLimits::unlimited}, {2, 40, 10}}) {
    std::mt19937_64 random(3);
    std::int64_t with = 0, without = 0;
    for (int trial = 0; trial < 20; ++trial) {
      const ModeWeights weights = test::random_weights(random, modes, intervals, false);
      SwitchLimits limits = one_hot_limits(modes);
      limits.max_changes = changes;
      std::vector<int> warm;
      sum_up_rounding(weights, warm);
      const Rounded plain = approximate(weights, limits, {.table_entries = 0}, Deadline::never(), warm);
      const Rounded quick = approximate(weights, limits, {}, Deadline::never(), warm);
      EXPECT_EQ(plain.report.cost, quick.report.cost) << trial;
      EXPECT_EQ(plain.modes, quick.modes) << trial;
      with += quick.report.nodes;
      without += plain.report.nodes;
    }
    EXPECT_LT(5 * with, 4 * without) << modes;
  }
}

/// Weights of two modes that want many changes, on 200 intervals.
ModeWeights chattering() {
  ModeWeights weights(2, std::vector<double>(200, 1.0));
  for (std::size_t k = 0; k < 200; ++k) {
    weights.at(k, 0) = 0.5 + 0.4 * std::sin(0.05 * static_cast<double>(k));
    weights.at(k, 1) = 1.0 - weights.at(k, 0);
  }
  return weights;
}

TEST(IntegralApproximation, MoreChangesNeverHurtAndLongGridsAreSolved) {
  const ModeWeights weights = chattering();
  SwitchLimits limits = one_hot_limits(2);
  limits.patterns = {0, 1};
  limits.switches.resize(1);
  limits.in_force = 0;
  double before = HUGE_VAL;
  for (const int changes : {0, 1, 2, 3, 5, 8}) {
    limits.max_changes = changes;
    const Rounded found = approximate(weights, limits, {.table_entries = 1 << 16});
    ASSERT_EQ(found.report.status, Status::optimal);
    EXPECT_LE(found.report.cost, before) << changes;
    EXPECT_LE(found.report.changes, changes);
    before = found.report.cost;
  }
  EXPECT_LT(before, 20.0);
}

TEST(IntegralApproximation, DwellIsKeptFromTheCommandInForce) {
  ModeWeights weights(2, {1, 1, 1, 1, 1, 1});
  for (std::size_t k = 0; k < 6; ++k) weights.at(k, 1) = 1.0;
  SwitchLimits limits = one_hot_limits(2);
  limits.patterns = {0, 1};
  limits.switches = {{.min_off = 4.0, .age = 1.0}};
  limits.in_force = 0;
  EXPECT_EQ(approximate(weights, limits).modes, (std::vector<int>{0, 0, 0, 1, 1, 1}));
  limits.in_force = -1;
  EXPECT_EQ(approximate(weights, limits).modes, (std::vector<int>(6, 1)));
}

TEST(IntegralApproximation, StoppedSearchesLeaveTheirBestAndAValidBound) {
  std::mt19937_64 random(4);
  int open = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const ModeWeights weights = test::random_weights(random, 4, 16, trial % 2);
    SwitchLimits limits = one_hot_limits(4);
    for (auto& s : limits.switches) s.min_on = s.min_off = 2.2 * weights.dt[0];
    const double optimum = approximate(weights, limits).report.cost;
    double before = HUGE_VAL;
    for (const std::int64_t nodes : {16, 64, 256, 1024}) {
      const Rounded found = approximate(weights, limits, {.max_nodes = nodes});
      EXPECT_LE(found.report.bound, optimum);
      EXPECT_GE(found.report.cost, optimum);
      EXPECT_LE(found.report.cost, before);
      EXPECT_TRUE(!std::isfinite(found.report.cost) || walk_limits(limits, weights.dt, found.modes).allowed);
      before = found.report.cost;
      open += found.report.status == Status::iteration_limit;
      EXPECT_TRUE(found.report.status == Status::iteration_limit || found.report.cost == optimum);
    }
  }
  EXPECT_GT(open, 40);
}

TEST(IntegralApproximation, AWarmStartThatKeepsToTheLimitsIsNeverLost) {
  const ModeWeights weights = chattering();
  SwitchLimits limits = one_hot_limits(2);
  limits.max_changes = 8;
  const Rounded good = approximate(weights, limits, {.table_entries = 1 << 16});
  Rounded stopped = approximate(weights, limits, {.max_nodes = 0}, Deadline::never(), good.modes);
  EXPECT_EQ(stopped.report.status, Status::iteration_limit);
  EXPECT_EQ(stopped.modes, good.modes);
  EXPECT_EQ(stopped.report.cost, good.report.cost);
  limits.max_changes = 1;
  stopped = approximate(weights, limits, {.max_nodes = 0}, Deadline::never(), good.modes);
  EXPECT_FALSE(std::isfinite(stopped.report.cost));
}

TEST(IntegralApproximation, EveryStatus) {
  std::set<Status> seen;
  ModeWeights weights = chattering();
  SwitchLimits limits = one_hot_limits(2);
  const auto outcome = [&](const IntegralApproximationSettings& settings = {}, Deadline deadline = Deadline::never()) {
    const Status status = approximate(weights, limits, settings, deadline).report.status;
    seen.insert(status);
    return status;
  };
  EXPECT_EQ(outcome(), Status::optimal);
  limits.max_changes = 60;
  limits.in_force = 1;
  EXPECT_EQ(outcome({.max_nodes = 300}), Status::iteration_limit);
  const Rounded late = approximate(weights, limits, {.table_entries = 0}, Deadline(Deadline::Clock::now()));
  EXPECT_EQ(late.report.status, Status::deadline_reached);
  EXPECT_TRUE(std::isfinite(late.report.cost));  // the first dive is always made
  seen.insert(late.report.status);
  limits.in_force = 3;  // both on: no mode, and every mode is a change away
  limits.max_changes = 0;
  EXPECT_EQ(outcome(), Status::infeasible);
  limits.max_changes = 1;
  EXPECT_EQ(outcome(), Status::optimal);
  limits.switches.pop_back();
  EXPECT_EQ(outcome(), Status::numerical_failure);  // a pattern with a switch that is not there
  limits = one_hot_limits(2);
  weights.at(3, 0) = std::nan("");
  EXPECT_EQ(outcome(), Status::numerical_failure);
  EXPECT_EQ(seen.size(), 5u);
}

TEST(IntegralApproximation, RefusesImpossibleSizes) {
  IntegralApproximation search;
  EXPECT_THROW(search.prepare(0, 2, 2), std::invalid_argument);
  EXPECT_THROW(search.prepare(5, 0, 2), std::invalid_argument);
  EXPECT_THROW(search.prepare(5, 40, 40), std::invalid_argument);
  EXPECT_THROW(IntegralApproximation({.table_entries = 100}).prepare(5, 2, 2), std::invalid_argument);
  search.prepare(4, 2, 2);
  std::vector<int> modes(5);
  const ModeWeights weights(2, {1, 1, 1, 1, 1});
  EXPECT_EQ(search.solve(weights, one_hot_limits(2), modes, Deadline::never()).status, Status::numerical_failure);
}

TEST(SwitchLimits, OfAModeSetAreItsCoilsWithTheirAges) {
  const ModeSet modes("m", {{"a", 0.004, 0.001, 0.010}, {"b"}}, {{"off", 0}, {"a", 1}, {"ab", 3}}, {0.0},
                      {{1.0}, {1.0}});
  const SwitchTiming timing(modes, 0.001);
  DelayLines lines(0);
  lines.command(1, timing);
  lines.advance(4);
  const SwitchLimits limits = mode_set_limits(modes, timing, lines);
  EXPECT_EQ(limits.patterns, (std::vector<SwitchPattern>{0, 1, 3}));
  EXPECT_EQ(limits.in_force, 1);
  EXPECT_EQ(limits.switches[0].min_on, 10.0);
  EXPECT_EQ(limits.switches[0].age, 4.0);
  EXPECT_EQ(limits.switches[1].min_off, 0.0);
  const std::vector<double> dt = {5.0, 5.0, 5.0};
  EXPECT_FALSE(walk_limits(limits, dt, std::vector<int>{1, 0, 0}).allowed);  // 9 steps of 10
  EXPECT_TRUE(walk_limits(limits, dt, std::vector<int>{2, 1, 0}).allowed);
  EXPECT_EQ(walk_limits(limits, dt, std::vector<int>{2, 1, 0}).changes, 3);
}

}  // namespace
}  // namespace solenoid
