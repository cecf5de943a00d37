// Limits on commands and states: every plan of 10,000 solves in closed loop is put to a judge that knows nothing of delay
// lines, only the commands that were given, tick by tick.
#include "solvers/rounding/projected_gradient.hpp"
#include "solvers/rounding/relax_and_round.hpp"
#include "solvers/search/exhaustive.hpp"
#include "tests/support/naive_line.hpp"
#include "tests/support/recorded_problems.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <random>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace solenoid::test {
namespace {

using Kind = BrokenLimit::Kind;
using Hybrid = PrestabilisedActuator;

/// Limits of every coil, in ticks, and of states.
struct Limits {
  int on = 0, off = 0, changes = 0, window = 0;
  Bounds<Hybrid> bounds{};
};

/// The commands of a run so far, one a tick; those before it were those of the first.
class Judge {
 public:
  Judge(const ModeSet& modes, const Limits& limits) : modes_(modes), limits_(limits) {}

  void add(SwitchPattern commanded) { given_.push_back(commanded); }

  /// What a plan breaks that would be given from now on; empty: nothing.
  std::string broken(const Problem<Hybrid>& problem, const Plan<Hybrid>& plan) const {
    std::vector<SwitchPattern> all = given_;
    for (std::size_t b = 0; b < plan.modes.size(); ++b)
      all.insert(all.end(), static_cast<std::size_t>(problem.horizon.blocks[b]), modes_.pattern(plan.modes[b]));
    for (int c = 0; c < modes_.switch_count(); ++c)
      if (std::string wrong = broken_by(c, all); !wrong.empty()) return wrong;
    return broken_states(problem, all);
  }

 private:
  static bool on(SwitchPattern pattern, int c) { return (pattern >> c) & 1u; }

  std::string broken_by(int c, const std::vector<SwitchPattern>& all) const {
    std::vector<std::size_t> changes;
    for (std::size_t t = 1; t < all.size(); ++t) {
      if (on(all[t], c) == on(all[t - 1], c)) continue;
      const bool planned = t >= given_.size();
      const int least = on(all[t - 1], c) ? limits_.on : limits_.off;
      if (planned && !changes.empty() && t - changes.back() < static_cast<std::size_t>(least))
        return fmt::format("coil {} changes {} ticks after its last change", c, t - changes.back());
      changes.push_back(t);
      const auto recent = std::ranges::count_if(
          changes, [&](std::size_t then) { return t - then < static_cast<std::size_t>(limits_.window); });
      if (planned && limits_.changes > 0 && recent > limits_.changes)
        return fmt::format("coil {} changes {} times in its window", c, recent);
    }
    return "";
  }

  /// Steps the model along, edge by edge, from the problem's state.
  std::string broken_states(const Problem<Hybrid>& problem, const std::vector<SwitchPattern>& all) const {
    const SwitchTiming timing(modes_, problem.horizon.dt_s);
    std::vector<NaiveLine> lines;
    lines.reserve(static_cast<std::size_t>(modes_.switch_count()));
    for (int c = 0; c < modes_.switch_count(); ++c) lines.emplace_back(on(all.front(), c));
    StateOf<Hybrid> x = problem.initial;
    for (std::size_t t = 0; t < all.size(); ++t) {
      SwitchPattern in_effect = 0;
      for (std::size_t c = 0; c < lines.size(); ++c) {
        lines[c].command(on(all[t], static_cast<int>(c)), timing.rise[c], timing.fall[c]);
        in_effect |= static_cast<SwitchPattern>(lines[c].effective(0)) << c;
        lines[c].advance();
      }
      if (t < given_.size()) continue;
      const std::size_t j = t - given_.size();
      const auto force = problem.model.feedback<double>(x, problem.setpoint[j]);
      x = problem.model.step<double>(x, modes_.inputs<4>(in_effect), force, problem.horizon.dt_s);
      for (std::size_t i = 0; i < x.size(); ++i)
        if (limits_.bounds.state_penalty[i] == 0.0 &&
            (x[i] < limits_.bounds.state_lower[i] || x[i] > limits_.bounds.state_upper[i]))
          return fmt::format("state {} is {} after step {}", i, x[i], j);
    }
    return "";
  }

  const ModeSet& modes_;
  const Limits& limits_;
  std::vector<SwitchPattern> given_;
};

Problem<Hybrid> limited_problem(const char* valves, const std::vector<int>& periods, const Limits& limits) {
  auto problem = actuator_problem<Hybrid>(valves, periods, 1e-9);
  problem.cost.terminal = {30.0, 0.02};
  std::vector<Switch> switches(problem.modes.switches().begin(), problem.modes.switches().end());
  for (Switch& s : switches) {
    s.min_on_s = 1e-3 * limits.on;
    s.min_off_s = 1e-3 * limits.off;
    s.max_changes = limits.changes;
    s.window_s = 1e-3 * limits.window;
  }
  problem.modes = problem.modes.with_switches(std::move(switches));
  problem.bounds = limits.bounds;
  return problem;
}

struct Counts {
  int solves = 0, infeasible = 0, changes = 0, at_bound = 0, safe = 0;
};

/// Solves each 5 ms along a motion that goes where the bounds do not; every 700 ms a fault has the valves safe for 60 ms.
Counts closed_loop(const char* valves, const std::vector<int>& periods, const Limits& limits, Solver<Hybrid>& solver,
                   int solves) {
  auto problem = limited_problem(valves, periods, limits);
  const Trajectory motion = thesis_sine(problem.model.parameters().equilibrium_position_m());
  const SwitchTiming timing(problem.modes, 0.001);
  solver.prepare(problem);
  Plan<Hybrid> plan(problem);
  Judge judge(problem.modes, limits);
  problem.initial = {motion.start(), 0.0, 101325.0, 101325.0};
  Counts counts;
  SwitchPattern command = problem.modes.safe_pattern();
  for (int k = 0; counts.solves < solves; ++k) {
    const double time_s = 0.001 * k;
    const bool safe = k % 700 >= 640;
    if (k % 5 == 0 && !safe) {
      for (std::size_t j = 0; j < problem.reference.size(); ++j) {
        const auto at = [&](double ahead) {
          const MotionSample r = motion.at(time_s + 0.001 * ahead);
          return OutputOf<Hybrid>{r.value, r.rate};
        };
        problem.reference[j] = at(static_cast<double>(j + 1));
        problem.setpoint[j] = at(static_cast<double>(j));
      }
      shift_plan(problem.horizon, 5, plan);
      const AnyProblem& any = problem;
      const SolveReport report = static_cast<AnySolver&>(solver).solve(any, plan, Deadline::never());
      ++counts.solves;
      const std::string broken = judge.broken(problem, plan);
      if (usable(report.status)) {
        EXPECT_EQ(broken, "") << valves << " at " << time_s << " s";
        EXPECT_EQ(report.broken.kind, Kind::none);
        command = problem.modes.pattern(plan.modes.front());
      } else {
        ++counts.infeasible;
        EXPECT_EQ(report.status, Status::infeasible);
        EXPECT_NE(broken, "") << valves << " at " << time_s << " s: holding breaks nothing";
        EXPECT_NE(report.broken.kind, Kind::none);
        command = problem.modes.safe_pattern();  // as the ladder's last rung
      }
      if (testing::Test::HasFailure()) return counts;
      counts.at_bound += problem.initial[position] > limits.bounds.state_upper[position] - 2e-4;
    }
    if (safe) command = problem.modes.safe_pattern(), ++counts.safe;
    counts.changes += std::popcount(command ^ problem.lines.commanded());
    judge.add(command);
    problem.lines.command(command, timing);
    const auto force =
        problem.model.feedback<double>(problem.initial, {motion.at(time_s).value, motion.at(time_s).rate});
    problem.initial =
        problem.model.step<double>(problem.initial, problem.modes.inputs<4>(problem.lines.effective()), force, 0.001);
    problem.lines.advance(1);
  }
  return counts;
}

Limits strict() {
  Limits limits{.on = 12, .off = 7, .changes = 4, .window = 150};
  limits.bounds.state_upper[position] = 0.098;  // the motion wants 0.1
  limits.bounds.state_upper[pressure_a] = 2.3e5;
  limits.bounds.state_upper[pressure_b] = 2.3e5;
  limits.bounds.state_lower[velocity] = -0.12;
  limits.bounds.state_penalty[velocity] = 1e-3;
  return limits;
}

/// Each loop ran, switched, met its bounds, and found most problems feasible.
void expect_busy(const Counts& c, const char* what) {
  fmt::print("  {}: {} solves, {} of them infeasible, {} coil changes, {} solves at the bound\n", what, c.solves,
             c.infeasible, c.changes, c.at_bound);
  EXPECT_GT(c.changes, c.solves / 100) << what;
  EXPECT_GT(c.at_bound, c.solves / 50) << what;
  EXPECT_GT(c.safe, 100) << what;
  EXPECT_LT(c.infeasible, c.solves / 4) << what;
}

TEST(Limits, EveryPlanOfTenThousandKeepsDwellWindowsAndBounds) {
  const Limits limits = strict();
  BranchAndBound<Hybrid> search;
  Exhaustive<Hybrid> exhaustive;
  const ProjectedGradientSettings relaxing = {.most_iterations = 8, .tolerance = 1e-4};
  const auto rounding = [&](RoundingMethod method) {
    return RelaxAndRound<Hybrid>(std::make_unique<ProjectedGradient<Hybrid>>(relaxing), {.method = method});
  };
  auto cia = rounding(RoundingMethod::integral_approximation), sum_up = rounding(RoundingMethod::sum_up);
  const std::vector<int> short_blocks = {1, 1, 2, 4};
  expect_busy(closed_loop("two_way", short_blocks, limits, search, 2500), "two_way");
  expect_busy(closed_loop("dual_orifice", {1, 2, 5}, limits, search, 1500), "dual_orifice");
  expect_busy(closed_loop("pcm_2", {2, 6}, limits, search, 1500), "pcm_2");
  Limits of_three_way = limits;  // whose chambers cannot be closed: with a dwell they keep no hard bound
  of_three_way.bounds.state_upper[pressure_a] = of_three_way.bounds.state_upper[pressure_b] = 3e5;
  of_three_way.bounds.state_penalty[position] = 10.0;
  expect_busy(closed_loop("three_way", short_blocks, of_three_way, exhaustive, 1500), "three_way");
  expect_busy(closed_loop("two_way", short_blocks, limits, cia, 1500), "cia");
  expect_busy(closed_loop("two_way", short_blocks, limits, sum_up, 1500), "sum_up_rounding");
}

/// With limits in force the search is still exact: the plan of enumeration, to the last bit.
TEST(Limits, SearchEqualsEnumerationWithinThem) {
  const Limits limits = strict();
  auto problem = limited_problem("two_way", {1, 1, 2, 4}, limits);
  Exhaustive<Hybrid> all;
  BranchAndBound<Hybrid> search;
  const auto recorded =
      record_closed_loop(problem, thesis_sine(problem.model.parameters().equilibrium_position_m()), search);
  all.prepare(problem);
  search.prepare(problem);
  int feasible = 0;
  for (std::size_t i = 0; i < recorded.size(); i += 20) {
    recorded[i].pose(problem);
    Plan<Hybrid> a(problem), b = recorded[i].warm_start;
    const SolveReport full = all.solve(problem, a, Deadline::never()),
                      fast = search.solve(problem, b, Deadline::never());
    ASSERT_EQ(full.status, fast.status) << i;
    if (!usable(full.status)) continue;
    ++feasible;
    ASSERT_EQ(full.cost, fast.cost) << i;
    ASSERT_EQ(a.modes, b.modes) << i;
  }
  EXPECT_GT(feasible, 20);
}

/// A softened bound costs what it says: the hard one's plan where it is dear, the free one's where it costs nothing.
TEST(Limits, SoftenedBoundsCostTheirSquaredExcess) {
  Limits limits;
  limits.bounds.state_upper[position] = 0.03;
  limits.bounds.state_penalty[position] = 7.0;
  auto soft = limited_problem("two_way", {1, 3}, limits);
  soft.initial = {0.0305, 0.05, 2e5, 1e5};
  for (auto& r : soft.reference) r = {0.04, 0.0};
  for (auto& r : soft.setpoint) r = {0.04, 0.0};
  auto free = soft;
  free.bounds = {};
  Plan<Hybrid> plan(soft);
  for (int mode = 0; mode < soft.modes.size(); ++mode) {
    plan.modes = {mode, 0};
    const SolveReport without = evaluate(free, plan), with = evaluate(soft, plan);
    double excess = 0.0;
    Rollout<Hybrid> r(free);
    const SwitchTiming timing(free.modes, 0.001);
    for (std::size_t b = 0; b < plan.modes.size(); ++b)
      for (int i = 0; i < free.horizon.blocks[b]; ++i) {
        roll_block(free, timing, plan.modes[b], 1, {}, r);
        excess += std::pow(std::max(0.0, r.state[position] - 0.03), 2);
      }
    EXPECT_GT(excess, 0.0);
    EXPECT_NEAR(with.cost, without.cost + 7.0 * excess, 1e-12 * with.cost) << mode;
    EXPECT_EQ(with.status, Status::feasible);
  }
  auto hard = soft;
  hard.bounds.state_penalty = {};
  BranchAndBound<Hybrid> search;
  search.prepare(hard);
  AnySolver& any = search;
  const SolveReport report = any.solve(hard, plan, Deadline::never());
  EXPECT_EQ(report.status, Status::infeasible);  // it is beyond already
  EXPECT_EQ(report.broken.kind, Kind::state);
  EXPECT_EQ(report.broken.index, static_cast<int>(position));
  EXPECT_EQ(report.broken.step, 0);
  EXPECT_EQ(report.broken.limit, 0.03);
  EXPECT_GT(report.broken.value, 0.03);
}

/// Windows on their own: what may be commanded is what a list of the moments of changes says.
TEST(Limits, WindowsAgreeWithAListOfMoments) {
  std::mt19937_64 random(11);
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<std::uint64_t>(n)); };
  for (int trial = 0; trial < 40; ++trial) {
    const int n = 1 + below(8);
    SwitchTiming timing;
    timing.switches = n;
    std::vector<std::vector<int>> moments(static_cast<std::size_t>(n));
    for (std::size_t c = 0; c < moments.size(); ++c) {
      if (below(4) == 0) continue;
      timing.windowed |= SwitchPattern{1} << c;
      timing.max_changes[c] = 1 + below(8);
      timing.window[c] = 1 + below(300);
    }
    DelayLines lines(0);
    int now = 0;
    for (int round = 0; round < 600; ++round) {
      const auto pattern = static_cast<SwitchPattern>(random()) & first_switches(static_cast<std::size_t>(n));
      bool free = true;
      for (std::size_t c = 0; c < moments.size(); ++c) {
        const auto recent = std::ranges::count_if(moments[c], [&](int then) { return now - then < timing.window[c]; });
        if ((timing.windowed >> c) & 1u) {
          ASSERT_EQ(lines.changes_within(c, timing.window[c]), recent);
        }
        if (((pattern ^ lines.commanded()) & timing.windowed) >> c & 1u) free = free && recent < timing.max_changes[c];
      }
      ASSERT_EQ(lines.may_command(pattern, timing), free);
      ASSERT_EQ(lines.broken_by(pattern, timing).kind == Kind::none, free);
      if (free) {
        for (std::size_t c = 0; c < moments.size(); ++c)
          if (((pattern ^ lines.commanded()) >> c) & 1u) moments[c].push_back(now);
        lines.command(pattern, timing);
      }
      const int steps = below(trial % 2 ? 10 : 100);
      lines.advance(steps);
      now += steps;
    }
  }
}

TEST(Limits, RefusesWindowsItCannotRemember) {
  ModeSet modes = valve_modes("pcm_3", {});
  std::vector<Switch> switches(modes.switches().begin(), modes.switches().end());
  for (Switch& s : switches) s.max_changes = 6, s.window_s = 1.0;
  EXPECT_THROW(SwitchTiming(modes.with_switches(switches), 0.001), std::invalid_argument);  // 72 in all
  for (Switch& s : switches) s.max_changes = 5;
  EXPECT_EQ(SwitchTiming(modes.with_switches(switches), 0.001).window[3], 1000);
  switches[0].window_s = 0.0;
  EXPECT_THROW(SwitchTiming(modes.with_switches(switches), 0.001), std::invalid_argument);
}

}  // namespace
}  // namespace solenoid::test
