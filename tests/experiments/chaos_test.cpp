// Trouble at random moments: the command itself, for a short time. Not alone on its processors, as what is in real time is:
// others' work is one trouble more.
#include "tests/experiments/program_under_test.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using test::ProgramRun;
using test::run_program;

/// Two minutes of it, with a wall clock that jumps back by an hour in every process after its first second.
TEST(Chaos, LosesNoResultAndLeavesNoOutputStanding) {
  const Folder folder;
  const ProgramRun run = run_program(folder, "chaos --duration 120 --seed 7 --format json",
                                     "LD_PRELOAD='" SOLENOID_STEPPED_CLOCK "' STEPPED_CLOCK_REPORT=clock.txt");
  ASSERT_TRUE(run.exit_code == 0 || run.exit_code == 1) << run.err;
  const auto found = nlohmann::json::parse(run.out);
  EXPECT_EQ(found.at("findings"), nlohmann::json::array());
  EXPECT_GE(found.at("campaigns"), 1);
  EXPECT_GE(found.at("results"), 48);
  EXPECT_GE(found.at("traces"), 48);
  EXPECT_GE(found.at("runs"), 1);
  EXPECT_GE(found.at("strikes").size(), 6u);
  EXPECT_TRUE(std::filesystem::exists(folder / "clock.txt"));
}

TEST(Chaos, IsToldApartFromWhatItCannotDo) {
  const Folder folder;
  EXPECT_THAT(test::refusal_of(folder, "chaos --duration nan"), testing::HasSubstr("--duration"));
  EXPECT_THAT(test::refusal_of(folder, "soak --load -1"), testing::HasSubstr("--load"));
  EXPECT_THAT(test::refusal_of(folder, "soak --variant nobody"), testing::HasSubstr("nobody"));
}

}  // namespace
}  // namespace solenoid
