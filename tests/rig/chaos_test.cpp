// Trouble at random moments, and a long run under load: the commands themselves, for a short time.
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

TEST(Soak, AccountsForEveryTickInConstantMemory) {
  const Folder folder;
  const ProgramRun run = run_program(folder, "soak --duration 10 --format json");
  ASSERT_TRUE(run.exit_code == 0 || run.exit_code == 1) << run.err << run.out;
  const auto found = nlohmann::json::parse(run.out);
  EXPECT_EQ(found.at("findings"), nlohmann::json::array());
  EXPECT_EQ(found.at("ticks").get<int>() + found.at("skipped").get<int>(), found.at("due").get<int>());
  EXPECT_NEAR(found.at("due").get<double>(), 10'027, 3);
  EXPECT_GE(found.at("looks").size(), 10u);
}

}  // namespace
}  // namespace solenoid
