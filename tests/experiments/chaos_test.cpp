// Trouble at random moments: the command itself, for a short time. Not alone on its processors, as what is in real time is:
// others' work is one trouble more.
#include "experiments/rig/chaos.hpp"

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

/// What is found of a node that does what a shell script says, beside a run that does nothing.
std::vector<std::string> found_of_node(const std::string& script) {
  const Folder folder;
  ChaosSettings settings;
  settings.program = folder.write_script(
      "program", "report=$7\ncase $1 in emulator) " + script + ";; compare) mkdir -p \"$4/runs\";; esac\n");
  settings.folder = folder.file("out");
  settings.duration_s = 1.5;
  return chaos(
             settings, [] { return false; }, [](const std::string&) {})
      .findings;
}

/// The script's command that leaves a report.
std::string reports(double safe_after_ms) {
  const nlohmann::json report = {{"timeouts", 1}, {"safe_after_ms", safe_after_ms}, {"sessions", 1}, {"refused", 0}};
  return "echo '" + report.dump() + "' >\"$report\"";
}

TEST(Chaos, FindsANodeThatIsLateToBeSafeOrLeavesNoWord) {
  using testing::Each;
  using testing::HasSubstr;
  using testing::IsEmpty;
  const auto is_found = [](const std::string& text) {
    return testing::AllOf(testing::Not(IsEmpty()), Each(HasSubstr(text)));
  };
  EXPECT_THAT(found_of_node(reports(21)), IsEmpty());
  EXPECT_THAT(found_of_node(reports(150)), is_found("outputs safe 150.0 ms after the last command (promised: 20"));
  EXPECT_THAT(found_of_node("true"), is_found("the node left no report"));
  EXPECT_THAT(found_of_node("exit 3"), is_found("the node ended with 3"));
  EXPECT_THAT(found_of_node("trap '' TERM; sleep 60"), is_found("the node had to be killed"));
  const std::string waits = "ends() { " + reports(21) + "; exit 0; }; trap ends TERM; while true; do sleep 0.1; done";
  EXPECT_THAT(found_of_node(waits), is_found("the node did not end by itself"));
}

}  // namespace
}  // namespace solenoid
