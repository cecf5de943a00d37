#include "controllers/systems/actuator/four_candidates.hpp"

#include "controllers/systems.hpp"
#include "core/mpc/switch_fault.hpp"
#include "core/systems/actuator/valves.hpp"
#include "tests/support/variant_text.hpp"

#include <array>
#include <set>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// Which way each chamber's net flow goes in a mode.
std::set<std::pair<bool, bool>> directions(const ModeSet& modes) {
  std::set<std::pair<bool, bool>> all;
  for (const Mode& mode : modes.modes()) {
    const SwitchedPoint p = modes.point(mode.pattern);
    all.emplace(p[fill_a] > p[exhaust_a], p[fill_b] > p[exhaust_b]);
  }
  return all;
}

// What is left of a bank when one coil leaks, or one of a path's two stays closed, still drives both chambers both ways.
TEST(FourCandidates, DriveBothChambersBothWaysWithWhatIsLeft) {
  for (const char* valves : {"two_way", "pcm_2", "pcm_3"}) {
    const ModeSet all = valve_modes(valves, {});
    std::vector<ModeSet> sets = {all};
    for (std::size_t c = 0; c < all.switches().size(); ++c) {
      sets.push_back(*with_fault(all, c, {SwitchFaultKind::leaking, 0.3}, 0.001));
      if (all.switches().size() > 4) sets.push_back(*with_fault(all, c, {SwitchFaultKind::stuck_off}, 0.001));
    }
    for (const ModeSet& set : sets) {
      const FourCandidates four(PneumaticActuator(), set, 0.001);
      EXPECT_EQ(four.modes().size(), 4) << valves;
      EXPECT_EQ(directions(four.modes()).size(), 4u) << valves;
    }
  }
}

// Where the coils' limits allow none of the four, what is commanded goes on: it breaks none.
TEST(FourCandidates, HoldTheCommandWhereLimitsAllowNoOther) {
  const VariantConfig v = test::variant_of(
      "valves = 'two_way'\nsolver = 'branch_and_bound'\n[limits]\nleast_on_ms = 10\nleast_off_ms = 60\n");
  const ModeSet modes = system_of(v).modes(v);
  FourCandidates four(PneumaticActuator(), modes, v.timing.tick_s);
  const SwitchTiming timing(modes, v.timing.tick_s);
  constexpr SwitchPattern supply_a = 1, supply_b = 4, exhaust_b_coil = 8;
  DelayLines lines(0);
  for (const SwitchPattern command : {supply_a | exhaust_b_coil, supply_a | supply_b, supply_a}) {
    ASSERT_TRUE(lines.may_command(command, timing));
    lines.command(command, timing);
    lines.advance(10);
  }
  // Both of chamber B's valves were closed less than 60 ms ago, and each of the four opens one.
  for (const Mode& mode : four.modes().modes()) ASSERT_FALSE(lines.may_command(mode.pattern, timing));
  const RestartableReference reference{Trajectory(0.05)};
  EXPECT_EQ(four.search({0.05, 0.0, 2e5, 2e5}, lines, reference, 0.0), supply_a);
}

}  // namespace
}  // namespace solenoid
