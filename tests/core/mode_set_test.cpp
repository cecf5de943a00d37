#include "core/mpc/mode_set.hpp"

#include "core/systems/actuator/valves.hpp"
#include "tests/support/naive_line.hpp"

#include <algorithm>
#include <bit>
#include <random>
#include <set>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

class RandomLines : public testing::TestWithParam<int> {};

TEST_P(RandomLines, AgreeWithAListOfScheduledEdges) {
  std::mt19937_64 random(static_cast<std::uint64_t>(GetParam()));
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<std::uint64_t>(n)); };
  const int n = 1 + below(GetParam() % 4 ? 8 : 32), longest = GetParam() % 2 ? 6 : 63;
  const auto any_pattern = [&] {
    return static_cast<SwitchPattern>(random()) & first_switches(static_cast<std::size_t>(n));
  };
  SwitchTiming timing;
  timing.switches = n;
  for (std::size_t c = 0; c < max_switches; ++c)
    timing.rise[c] = below(longest), timing.fall[c] = below(longest), timing.dwell[c] = below(10);
  timing.groups = static_cast<std::size_t>(GetParam() % 3 ? 0 : 1 + below(3));
  for (std::size_t g = 0; g < timing.groups; ++g) timing.group[g] = any_pattern();
  const SwitchPattern start = any_pattern();
  DelayLines lines(start);
  std::vector<test::NaiveLine> naive;
  naive.reserve(static_cast<std::size_t>(n));
  for (int c = 0; c < n; ++c) naive.emplace_back((start >> c) & 1u);
  const auto effective = [&](int ahead) {
    SwitchPattern pattern = 0;
    for (int c = 0; c < n; ++c)
      pattern |= static_cast<SwitchPattern>(naive[static_cast<std::size_t>(c)].effective(ahead)) << c;
    return pattern;
  };
  for (int round = 0; round < 400; ++round) {
    const SwitchPattern pattern = any_pattern();
    bool free = true;
    for (std::size_t c = 0; c < naive.size(); ++c)
      if (naive[c].commanded() != (((pattern >> c) & 1u) != 0)) free = free && naive[c].free(timing.dwell[c]);
    for (std::size_t g = 0; g < timing.groups; ++g) {
      int changes = 0;
      for (std::size_t c = 0; c < naive.size(); ++c)
        changes += ((timing.group[g] >> c) & 1u) != 0 && naive[c].commanded() != (((pattern >> c) & 1u) != 0);
      free = free && changes <= 1;
    }
    ASSERT_EQ(lines.may_command(pattern, timing), free);
    lines.command(pattern, timing);
    for (std::size_t c = 0; c < naive.size(); ++c)
      naive[c].command((pattern >> c) & 1u, timing.rise[c], timing.fall[c]);
    ASSERT_EQ(lines.commanded(), pattern);
    int last_change = 0;
    for (int ahead = 0; ahead < 70; ++ahead) {
      ASSERT_EQ(lines.effective(ahead), effective(ahead)) << "round " << round << " ahead " << ahead;
      if (ahead > 0 && lines.effective(ahead) != lines.effective(ahead - 1)) last_change = ahead;
    }
    ASSERT_EQ(lines.settled_after(), last_change);
    const int steps = below(GetParam() % 2 ? 8 : 70);
    DelayLines one_by_one = lines;
    for (int i = 0; i < steps; ++i) {
      one_by_one.advance(1);
      for (test::NaiveLine& line : naive) line.advance();
    }
    const SwitchPattern then = lines.effective(steps);
    lines.advance(steps);
    ASSERT_EQ(lines, one_by_one);
    ASSERT_EQ(lines.effective(), then);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomLines, testing::Range(1, 25));

TEST(DelayLines, SwallowAPulseShorterThanItsDelay) {
  SwitchTiming timing;
  timing.rise[0] = 4, timing.fall[0] = 1;
  DelayLines lines(0);
  lines.command(1, timing);
  lines.advance(2);
  lines.command(0, timing);  // falls at 3, before the rise at 4
  for (int ahead = 0; ahead < 10; ++ahead) EXPECT_EQ(lines.effective(ahead), 0u);
}

void expect_refused(const std::function<void()>& make, const std::string& words) {
  try {
    make();
    ADD_FAILURE() << "accepted; expected: " << words;
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(words));
  }
}

TEST(ModeSet, RefusesWhatIsWrongByName) {
  const auto build = [](const std::vector<Switch>& s, const std::vector<Mode>& m,
                        const std::vector<std::vector<double>>& gain) {
    return [=] { ModeSet("m", s, m, {0.0}, gain); };
  };
  expect_refused(build(std::vector<Switch>(33), {{"a", 0}}, std::vector<std::vector<double>>(33, {1.0})),
                 "33 switches; at most 32");
  expect_refused(build({{"s"}}, {}, {{1.0}}), "at least one mode");
  expect_refused(build({{"s"}}, {{"far", 2}}, {{1.0}}), "'far' uses a switch beyond");
  expect_refused(build({{"s"}}, {{"a", 1}, {"b", 1}}, {{1.0}}), "'a' and 'b' are the same");
  expect_refused(build({{"s"}}, {{"a", 0}}, {}), "one gain column");
  expect_refused(build({{"s"}}, {{"a", 0}}, {{1.0, 2.0}}), "gain of switch 's' needs 1");
  const auto timing = [](const Switch& s) {
    return [=] { SwitchTiming(ModeSet("m", {s}, {{"a", 0}}, {0.0}, {{1.0}}), 1e-3); };
  };
  const auto grouped = [](const std::vector<SwitchPattern>& groups) {
    return [=] { ModeSet("m", {{"s"}, {"t"}}, {{"a", 0}}, {0.0}, {{1.0}, {1.0}}, groups); };
  };
  expect_refused(grouped({4 | 1}), "a group has a switch beyond the 2");
  expect_refused(grouped({2}), "needs two switches or more");
  expect_refused(grouped(std::vector<SwitchPattern>(33, 3)), "33 groups");
  EXPECT_NO_THROW(grouped({3})());
  expect_refused(timing({"s", 0.063}), "rise_delay of 0.063 s is 63 steps");
  expect_refused(timing({"s", 0, -0.001}), "fall_delay");
  expect_refused(timing({"s", 0, 0, 0.1}), "min_dwell");
  EXPECT_NO_THROW(timing({"s", 0.062, 0.062, 0.062})());
}

TEST(ModeSet, LeastDwellsRoundUpToTheStepAndDelaysToTheNearest) {
  constexpr double dt = 0.1;
  const auto of = [](double time_s) {
    return ModeSet("m", {{"s", time_s, time_s, time_s}}, {{"a", 0}}, {0.0}, {{1.0}});
  };
  struct Case {
    double time_s;
    int delay, dwell;
  };
  // 3 * 0.1 is above 0.3: a multiple of the step but for rounding is that multiple.
  for (const Case& c : {Case{0.24, 2, 3}, {0.26, 3, 3}, {0.201, 2, 3}, {0.2, 2, 2}, {3 * 0.1, 3, 3}, {0.0, 0, 0}}) {
    const SwitchTiming timing(of(c.time_s), dt);
    EXPECT_EQ(timing.rise[0], c.delay) << c.time_s;
    EXPECT_EQ(timing.fall[0], c.delay) << c.time_s;
    EXPECT_EQ(timing.dwell[0], c.dwell) << c.time_s;
  }
  EXPECT_THAT(rounded_times(of(0.24), dt),
              testing::ElementsAre("switch 's': rise_delay of 240 ms is 2 steps of 100 ms",
                                   "switch 's': fall_delay of 240 ms is 2 steps of 100 ms",
                                   "switch 's': min_dwell of 240 ms is 3 steps of 100 ms"));
  EXPECT_THAT(rounded_times(of(0.2), dt), testing::IsEmpty());
}

TEST(ModeSet, ScalesDelaysAndKeepsTheRest) {
  const ModeSet slow = valve_modes("two_way", {}).with_delays_scaled(1.5);
  const SwitchTiming timing(slow, 1e-3);
  EXPECT_EQ(timing.rise[0], 6);
  EXPECT_EQ(timing.fall[0], 2);  // 1.5 steps, rounded
  EXPECT_EQ(slow.size(), 9);
}

TEST(ModeSet, OfAGroupOneSwitchChangesWithOneCommand) {
  const ModeSet modes("m", std::vector<Switch>(4), {{"a", 0}}, {0.0}, std::vector<std::vector<double>>(4, {1.0}),
                      {0b0011, 0b1100});
  EXPECT_THAT(modes.one_at_a_time(), testing::ElementsAre(0b0011u, 0b1100u));
  EXPECT_THAT(modes.with_delays_scaled(2.0).one_at_a_time(), testing::ElementsAre(0b0011u, 0b1100u));
  const SwitchTiming timing(modes, 1e-3);
  for (SwitchPattern from = 0; from < 16; ++from) {
    const DelayLines lines(from);
    EXPECT_TRUE(lines.may_command(from, timing));
    EXPECT_TRUE(lines.may_command(from ^ 0b0110u, timing));  // one of each
    EXPECT_FALSE(lines.may_command(from ^ 0b0011u, timing));
    EXPECT_FALSE(lines.may_command(from ^ 0b1101u, timing));
  }
}

TEST(Valves, MapEveryPatternToItsOpenings) {
  const ModeSet three_way = valve_modes("three_way", {});
  ASSERT_EQ(three_way.size(), 4);
  for (SwitchPattern u = 0; u < 4; ++u) {
    EXPECT_EQ(three_way.pattern(static_cast<int>(u)), u);  // mode = u_p of Table 5-1
    const double a = u & 1u, b = u >> 1;
    EXPECT_THAT(three_way.point(u), testing::ElementsAre(a, 1 - a, b, 1 - b));
  }
  for (const auto& [name, size] : {std::pair{"two_way", 9}, {"seven_mode", 7}, {"three_mode", 3}}) {
    const ModeSet modes = valve_modes(name, {});
    ASSERT_EQ(modes.size(), size) << name;
    EXPECT_EQ(modes.pattern(0), 0u);
    for (const Mode& mode : modes.modes()) {
      const SwitchPattern q = mode.pattern;
      EXPECT_THAT(modes.point(q), testing::ElementsAre(q & 1u, (q >> 1) & 1u, (q >> 2) & 1u, (q >> 3) & 1u));
      EXPECT_NE(q & 3u, 3u) << "supply and exhaust of A";
      EXPECT_NE(q >> 2, 3u) << "supply and exhaust of B";
    }
  }
  const ModeSet seven = valve_modes("seven_mode", {});
  EXPECT_EQ(seven.find(0b0101), -1);  // both fill
  EXPECT_EQ(seven.find(0b1010), -1);  // both exhaust
  const ModeSet three = valve_modes("three_mode", {});
  EXPECT_NE(three.find(0b1001), -1);
  EXPECT_NE(three.find(0b0110), -1);
  expect_refused([] { valve_modes("five_way", {}); }, "three_way, two_way, three_mode, seven_mode");
}

/// Chamber by chamber, from the coils alone: the openings of the valves that are on.
void expect_bank(const char* name, std::size_t valves, const std::vector<double>& openings, int modes_a_chamber) {
  const ModeSet modes = valve_modes(name, {});
  ASSERT_EQ(modes.switch_count(), static_cast<int>(4 * valves)) << name;
  ASSERT_EQ(modes.size(), modes_a_chamber * modes_a_chamber) << name;
  std::set<std::vector<double>> seen;
  for (int m = 0; m < modes.size(); ++m) {
    const SwitchPattern q = modes.pattern(m);
    std::vector<double> expected;
    for (std::size_t path = 0; path < 4; ++path) {
      double sum = 0.0;
      for (std::size_t i = 0; i < valves; ++i)
        if ((q >> (path * valves + i)) & 1u) sum += openings[i];
      expected.push_back(sum);
    }
    const SwitchedPoint point = modes.point(q);
    for (std::size_t path = 0; path < 4; ++path) EXPECT_NEAR(point[path], expected[path], 1e-15) << name << q;
    EXPECT_EQ(point[0] * point[1], 0.0) << "supply and exhaust of A: " << modes.modes()[std::size_t(m)].name;
    EXPECT_EQ(point[2] * point[3], 0.0) << "supply and exhaust of B: " << modes.modes()[std::size_t(m)].name;
    EXPECT_LE(*std::ranges::max_element(point), 1.0 + 1e-15);
    EXPECT_TRUE(seen.insert({point.begin(), point.end()}).second) << "two modes open alike";
    EXPECT_EQ(modes.find(q), m);
  }
  EXPECT_EQ(modes.pattern(0), 0u);
  EXPECT_EQ(modes.safe_pattern(), 0u);
  for (std::size_t path = 0; path < 4; ++path) {  // the largest flow is the single valve's
    double most = 0.0;
    for (const std::vector<double>& point : seen) most = std::max(most, point[path]);
    EXPECT_NEAR(most, 1.0, 1e-15) << name;
  }
}

TEST(Valves, BanksOpenInStepsUpToTheSingleValveAndNeverShort) {
  expect_bank("dual_orifice", 2, {small_orifice, 1.0}, 5);
  expect_bank("pcm_2", 2, {1.0 / 3, 2.0 / 3}, 7);
  expect_bank("pcm_3", 3, {1.0 / 7, 2.0 / 7, 4.0 / 7}, 15);
  expect_bank("pcm_4", 4, {1.0 / 15, 2.0 / 15, 4.0 / 15, 8.0 / 15}, 31);
  const ModeSet dual = valve_modes("dual_orifice", {});
  for (const Mode& mode : dual.modes())
    for (const int chamber : {0, 4}) EXPECT_LE(std::popcount((mode.pattern >> chamber) & 15u), 1) << mode.name;
}

/// Up to 32 switches: points are the affine map, added up in another order and in whole numbers, which are exact.
TEST(ModeSet, OfAnySizeMapsEveryPatternByItsGains) {
  std::mt19937_64 random(5);
  for (const std::size_t switches : {0, 1, 7, 8, 9, 16, 17, 31, 32}) {
    std::vector<Switch> names(switches);
    std::vector<std::vector<double>> gain(switches, std::vector<double>(3));
    for (auto& column : gain)
      for (double& g : column) g = static_cast<double>(random() % 2001) - 1000.0;
    std::set<SwitchPattern> some = {0, first_switches(switches)};
    for (int i = 0; i < 200; ++i) some.insert(static_cast<SwitchPattern>(random()) & first_switches(switches));
    std::vector<Mode> modes;
    modes.reserve(some.size());
    for (const SwitchPattern p : some) modes.push_back({fmt::format("{:b}", p), p});
    std::shuffle(modes.begin(), modes.end(), random);
    const ModeSet set("drawn", names, modes, {1.0, -2.0, 3.0}, gain);
    for (const Mode& mode : modes) {
      std::vector<double> expected = {1.0, -2.0, 3.0};
      for (std::size_t c = switches; c-- > 0;)
        if ((mode.pattern >> c) & 1u)
          for (std::size_t i = 0; i < 3; ++i) expected[i] += gain[c][i];
      ASSERT_THAT(set.point(mode.pattern), testing::ElementsAreArray(expected)) << switches;
      ASSERT_THAT(set.inputs<3>(mode.pattern), testing::ElementsAreArray(expected)) << switches;
      ASSERT_EQ(set.pattern(set.find(mode.pattern)), mode.pattern);
    }
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t c = 0; c < switches; ++c) EXPECT_EQ((set.lowering(i) >> c) & 1u, gain[c][i] < 0) << switches;
    EXPECT_EQ(set.find(switches == 32 ? 1u << 31 ^ 12345u : ~SwitchPattern{0}) >= 0, false);
  }
}

TEST(ModeSet, TheSafePatternIsAModeByDefaultEverySwitchOffOrTheFirst) {
  const std::vector<Mode> with_off = {{"a", 0b01}, {"none", 0b00}}, without = {{"a", 0b01}, {"b", 0b10}};
  const auto set = [](const std::vector<Mode>& modes, std::optional<SwitchPattern> safe) {
    return ModeSet("m", {{"a"}, {"b"}}, modes, {0}, {{1}, {1}}, {}, safe);
  };
  EXPECT_EQ(set(with_off, {}).safe_pattern(), 0b00u);
  EXPECT_EQ(set(without, {}).safe_pattern(), 0b01u);
  EXPECT_EQ(set(without, 0b10).safe_pattern(), 0b10u);
  EXPECT_EQ(set(without, 0b10).with_delays_scaled(2.0).safe_pattern(), 0b10u);
  EXPECT_THROW(set(without, 0b11), std::invalid_argument);
}

TEST(Valves, NeverOpenSupplyAndExhaustTogetherWhileEdgesAreInFlight) {
  for (const char* name : {"two_way", "seven_mode", "three_mode"}) {
    const ModeSet modes = valve_modes(name, {});
    const SwitchTiming timing(modes, 1e-3);
    std::mt19937_64 random(5);
    DelayLines lines(0);
    for (int period = 0; period < 5000; ++period) {
      lines.command(modes.pattern(static_cast<int>(random() % static_cast<std::uint64_t>(modes.size()))), timing);
      for (int i = 0; i < 5; ++i, lines.advance(1)) {
        const SwitchPattern open = lines.effective();
        ASSERT_NE(open & 3u, 3u) << name;
        ASSERT_NE(open >> 2, 3u) << name;
      }
    }
  }
}

TEST(Valves, BlockTheChamberBetweenFillAndExhaust) {
  const ModeSet modes = valve_modes("two_way", {});
  const SwitchTiming timing(modes, 1e-3);
  DelayLines lines(0b01);
  lines.command(0b10, timing);  // fill A to exhaust A: supply closes after 1 ms, exhaust opens after 4
  const SwitchPattern expected[] = {0b01, 0b00, 0b00, 0b00, 0b10};
  for (int i = 0; i < 5; ++i) EXPECT_EQ(lines.effective(i), expected[i]) << i << " ms";
}

}  // namespace
}  // namespace solenoid
