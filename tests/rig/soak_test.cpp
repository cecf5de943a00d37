// A long run under load: the command itself, for a short time.
#include "experiments/rig/soak.hpp"

#include "tests/experiments/program_under_test.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using test::ProgramRun;
using test::run_program;

void expect_nothing_found(const nlohmann::json& soak) {
  for (const std::string what : soak.at("findings"))
    if (!test::sanitized || !what.starts_with("memory grew")) ADD_FAILURE() << what;
}

TEST(Soak, AccountsForEveryTickInConstantMemory) {
  const Folder folder;
  const ProgramRun run = run_program(folder, "soak --duration 10 --format json");
  ASSERT_TRUE(run.exit_code == 0 || run.exit_code == 1) << run.err << run.out;
  const auto found = nlohmann::json::parse(run.out);
  expect_nothing_found(found);
  EXPECT_EQ(found.at("ticks").get<int>() + found.at("skipped").get<int>(), found.at("due").get<int>());
  EXPECT_NEAR(found.at("due").get<double>(), 10'027, 3);
  EXPECT_GE(found.at("looks").size(), 10u);
}

TEST(Soak, InterruptedEndsWithItsOwnCodeAndWhatItSaw) {
  const Folder folder;
  const std::string after_s = test::sanitized ? "20" : "6";
  const ProgramRun run =
      run_program(folder, "soak --duration 600 --format json", "timeout --preserve-status --signal INT " + after_s);
  ASSERT_EQ(run.exit_code, 130) << run.err << run.out;
  const auto found = nlohmann::json::parse(run.out);
  expect_nothing_found(found);
  EXPECT_EQ(found.at("exit_code"), 130);
  EXPECT_GT(found.at("ticks"), 100);
  EXPECT_GE(found.at("safe_entries"), 1);  // its end
}

TEST(Soak, InterruptedBeforeTheRunBeganFindsNothing) {
  const Folder folder;
  const ProgramRun run =
      run_program(folder, "soak --duration 600 --format json", "timeout --preserve-status --signal INT 0.3");
  EXPECT_EQ(run.exit_code, 130) << run.err << run.out;
}

/// What is found in a run that does what a shell script says; if `interrupted`, when it is ready.
std::vector<std::string> found_in(const std::string& script, bool interrupted) {
  const Folder folder;
  SoakSettings settings;
  settings.program = folder.write_script(
      "program", "ready=${0%/*}/ready\ncase $1 in emulator) exec sleep 60;; run) " + script + ";; esac\n");
  settings.folder = folder.file("out");
  settings.duration_s = 1.0;
  settings.overtime_s = 1.0;
  const auto now = [&] { return interrupted && std::filesystem::exists(folder / "ready"); };
  return soak(settings, now, [](const SoakOutcome::Look&) {}).findings;
}

TEST(Soak, FindsARunThatCrashesOrNeverEnds) {
  using testing::ElementsAre;
  using testing::StartsWith;
  const std::string hears_nothing = "trap '' INT; touch \"$ready\"; ";
  for (const bool interrupted : {false, true}) {
    SCOPED_TRACE(interrupted);
    EXPECT_THAT(found_in(hears_nothing + "ulimit -c 0; sleep 0.5; kill -SEGV $$", interrupted),
                ElementsAre(StartsWith("ended with 139: ")));
    EXPECT_THAT(found_in(hears_nothing + "exec sleep 60", interrupted), ElementsAre(StartsWith("had to be killed")));
  }
  EXPECT_THAT(found_in("exit 130", false), ElementsAre(StartsWith("ended with 130: ")));
  EXPECT_THAT(found_in("touch \"$ready\"; exec sleep 60", true), ElementsAre());
}

}  // namespace
}  // namespace solenoid
