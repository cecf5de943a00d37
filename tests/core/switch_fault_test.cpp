#include "core/mpc/switch_fault.hpp"

#include "core/systems/actuator/dynamics.hpp"
#include "core/systems/actuator/valves.hpp"

#include <algorithm>
#include <bit>
#include <stdexcept>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

constexpr double tick_s = 0.001;
constexpr std::array<std::array<std::size_t, 2>, 2> chambers = {{{fill_a, exhaust_a}, {fill_b, exhaust_b}}};

ModeSet valves(const char* name) { return valve_modes(name, {}); }

std::vector<double> point(const ModeSet& modes, SwitchPattern pattern) {
  const auto p = modes.point(pattern);
  return {p.begin(), p.end()};
}

TEST(SwitchFault, SaysWhatBecomesOfAState) {
  EXPECT_EQ((SwitchFault{SwitchFaultKind::stuck_on}).opening(0.0), 1.0);
  EXPECT_EQ((SwitchFault{SwitchFaultKind::stuck_off}).opening(1.0), 0.0);
  EXPECT_DOUBLE_EQ((SwitchFault{SwitchFaultKind::leaking, 0.2}).opening(0.0), 0.2);
  EXPECT_DOUBLE_EQ((SwitchFault{SwitchFaultKind::leaking, 0.2}).opening(1.0), 1.0);
  EXPECT_EQ((SwitchFault{SwitchFaultKind::slow, 0.01}).opening(0.5), 0.5);
}

// Every point of what is left, of every coil and fault, by its closed form: the opening that the fault makes of each state.
TEST(SwitchFault, PointsOfWhatIsLeftHaveTheFaultInThem) {
  for (const char* name : {"three_way", "two_way", "pcm_2", "dual_orifice"}) {
    const ModeSet all = valves(name);
    for (std::size_t c = 0; c < all.switches().size(); ++c)
      for (const SwitchFault fault : {SwitchFault{SwitchFaultKind::stuck_on}, SwitchFault{SwitchFaultKind::stuck_off},
                                      SwitchFault{SwitchFaultKind::leaking, 0.3}}) {
        const auto left = with_fault(all, c, fault, tick_s, chambers);
        ASSERT_TRUE(left) << name << " " << c;
        const auto on = point(all, SwitchPattern{1} << c), off = point(all, 0);
        for (SwitchPattern pattern = 0; pattern < SwitchPattern{1} << all.switch_count(); ++pattern) {
          const double sound = (pattern >> c) & 1u ? 1.0 : 0.0;
          auto expected = point(all, pattern);
          for (std::size_t i = 0; i < expected.size(); ++i)
            expected[i] += (fault.opening(sound) - sound) * (on[i] - off[i]);
          const auto got = point(*left, pattern);
          for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(got[i], expected[i], 1e-12);
        }
      }
  }
}

TEST(SwitchFault, AStuckSwitchIsNotCommandedAndModesStayOnceEach) {
  const ModeSet nine = valves("two_way");
  for (std::size_t c = 0; c < 4; ++c) {
    const auto closed = with_fault(nine, c, {SwitchFaultKind::stuck_off}, tick_s, chambers);
    ASSERT_TRUE(closed);
    EXPECT_EQ(closed->size(), 6);  // two of a chamber's three, three of the other's
    const auto open = with_fault(nine, c, {SwitchFaultKind::stuck_on}, tick_s, chambers);
    ASSERT_TRUE(open);
    EXPECT_EQ(open->size(), 6);  // the same: the opposed valve, as large, is the only one that turns the flow
    for (const auto& left : {closed, open})
      for (const Mode& mode : left->modes()) EXPECT_EQ((mode.pattern >> c) & 1u, 0u);
  }
}

// How long a stuck switch was on or off binds no one: a plan over what is left, which has it off, must be allowed at once.
TEST(SwitchFault, AStuckSwitchHasNoLimits) {
  const Switch limited{
      .name = "a", .min_dwell_s = 0.02, .min_on_s = 0.03, .min_off_s = 0.03, .max_changes = 3, .window_s = 0.1};
  Switch other = limited;
  other.name = "b";
  const ModeSet both("two", {limited, other}, {{"none", 0b00}, {"a", 0b01}, {"b", 0b10}}, {0.0}, {{1.0}, {1.0}});
  DelayLines lines(0b00);
  lines.command(0b01, SwitchTiming(both, tick_s));
  lines.advance(1);
  ASSERT_FALSE(lines.may_command(0b00, SwitchTiming(both, tick_s)));
  for (const SwitchFaultKind kind : {SwitchFaultKind::stuck_on, SwitchFaultKind::stuck_off}) {
    const auto left = with_fault(both, 0, {kind}, tick_s);
    ASSERT_TRUE(left);
    const SwitchTiming timing(*left, tick_s);
    EXPECT_TRUE(lines.may_command(0b00, timing)) << to_string(kind);
    EXPECT_TRUE(lines.may_command(0b10, timing)) << to_string(kind);
    EXPECT_EQ(timing.least(1, true), 30);
  }
}

// Pulse code: of a chamber's seven modes four use no given coil of a path with two; stuck open, of the three on the other
// path those stay that open at least as wide.
TEST(SwitchFault, ModesThatOpenInVainAgainstWhatStaysOpenAreLeftOut) {
  const ModeSet pulse = valves("pcm_2");
  const auto left = [&](std::size_t c, SwitchFault fault) {
    return with_fault(pulse, c, fault, tick_s, chambers)->size();
  };
  EXPECT_EQ(left(0, {SwitchFaultKind::stuck_off}), 5 * 7);
  EXPECT_EQ(left(0, {SwitchFaultKind::stuck_on}), 5 * 7);      // 1/3 open: exhausts by 1/3, 2/3 and 1
  EXPECT_EQ(left(1, {SwitchFaultKind::stuck_on}), 4 * 7);      // 2/3 open: exhausts by 2/3 and 1
  EXPECT_EQ(left(1, {SwitchFaultKind::leaking, 0.3}), 7 * 7);  // 0.2 of the path: less than any exhaust
  EXPECT_EQ(left(3, {SwitchFaultKind::slow, 0.01}), 7 * 7);
  const auto slow = with_fault(pulse, 3, {SwitchFaultKind::slow, 0.01}, tick_s);
  EXPECT_DOUBLE_EQ(slow->switches()[3].rise_delay_s, pulse.switches()[3].rise_delay_s + 0.01);
  EXPECT_DOUBLE_EQ(slow->switches()[2].rise_delay_s, pulse.switches()[2].rise_delay_s);
}

TEST(SwitchFault, NothingIsLeftWhereNoModeButTheSafeOneIs) {
  // Both modes of `three_mode` that move anything need every coil but the one of the other direction: one is left of two.
  const auto one = with_fault(valves("three_mode"), 0, {SwitchFaultKind::stuck_off}, tick_s, chambers);
  ASSERT_TRUE(one);
  EXPECT_EQ(one->size(), 2);
  const ModeSet single("single", {{"S"}}, {{"off", 0}, {"on", 1}}, {0.0}, {{1.0}});
  EXPECT_FALSE(with_fault(single, 0, {SwitchFaultKind::stuck_off}, tick_s));
  EXPECT_TRUE(with_fault(single, 0, {SwitchFaultKind::leaking, 0.5}, tick_s));
  EXPECT_THROW(with_fault(single, 1, {SwitchFaultKind::stuck_off}, tick_s), std::invalid_argument);
}

}  // namespace
}  // namespace solenoid
