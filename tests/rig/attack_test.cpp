#include "experiments/rig/node_attack.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using test::Folder;

/// Somebody on the wire, without the key: nothing of what they send moves an output, and all of it is counted.
TEST(Attack, MovesNothingAndIsCounted) {
  const Folder folder;
  const auto table = attack_node({.program = SOLENOID_PROGRAM,
                                  .folder = (folder / "").string(),
                                  .per_s = SOLENOID_TEST_ONE_IN == 1 ? 20'000.0 : 2'000.0,
                                  .seconds = 1.0});
  ASSERT_EQ(table.size(), 7u);
  for (const AttackOutcome& a : table) {
    SCOPED_TRACE(a.name + ": " + a.causes);
    ASSERT_EQ(a.problem, "");
    EXPECT_TRUE(withstood(a));
    EXPECT_EQ(a.packets, a.counted);
    EXPECT_EQ(a.uncounted(), 0);
    EXPECT_EQ(a.node_exit_code, 0);
    if (a.name == "nothing") continue;
    EXPECT_GT(a.sent, 100);
    if (a.name == "open" || a.name.starts_with("forged")) {
      EXPECT_EQ(a.no_packets, a.sent);
    }
    // Each as what it is; what the system had no room for may be anybody's.
    EXPECT_LE(a.sent - a.dropped, a.invalid + a.old + a.foreign + a.asked + a.offers);
    // A run that went on has every tick done or counted as skipped; one that did not says why.
    if (a.exit_code == 0) {
      EXPECT_NEAR(static_cast<double>(a.ticks + a.skipped), static_cast<double>(a.expected_ticks), 50.0);
      EXPECT_EQ(a.timeouts, 0);
      EXPECT_EQ(a.causes, "stopped");
    } else {
      EXPECT_EQ(a.exit_code, 1);
      EXPECT_THAT(a.causes, testing::AnyOf(testing::HasSubstr("stale"), testing::HasSubstr("gap"),
                                           testing::HasSubstr("I/O safe")));
    }
  }
}

/// Without a key the same attackers get through, and the table says so: it is no table that cannot fail.
TEST(Attack, OfANodeWithoutAKeyIsSeenToSucceed) {
  const Folder folder;
  const auto table = attack_node({.program = SOLENOID_PROGRAM,
                                  .folder = (folder / "").string(),
                                  .keyed = false,
                                  .per_s = 200.0,
                                  .seconds = 0.5,
                                  .only = "forged CRC"});
  ASSERT_EQ(table.size(), 1u);
  ASSERT_EQ(table[0].problem, "");
  EXPECT_FALSE(withstood(table[0]));
  EXPECT_EQ(table[0].invalid, 0);
}

}  // namespace
}  // namespace solenoid
