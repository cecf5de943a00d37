// The command as a process: against an emulator in real time, interrupted, and what it refuses.
#include "tests/experiments/program_under_test.hpp"
#include "tests/rig/undisturbed.hpp"

#include <map>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using test::ProgramRun;
using test::run_program;
using test::text_of;
using test::undisturbed;
using testing::HasSubstr;

bool node_left_alone(const ProgramRun& run) {
  return (run.out + run.err).find("went to its safe state by itself") != std::string::npos ||
         (run.out + run.err).find("stay away") != std::string::npos;
}

std::string emulator_with(const char* fault, int port) {
  return fmt::format(
      "{{ '{}' emulator --campaign identify --port {} --fault {} --idle-exit 20 --report node.json & }} 2>node.txt; "
      "sleep 0.5;",
      SOLENOID_PROGRAM, port, fault);
}

/// Real processes: what is wired wrongly is named, the record holds each step, and outputs are safe at the end.
TEST(CommissionProgram, NamesSwappedValvesOfTheEmulator) {
  const Folder folder;
  const auto make = [&] {
    const int port = test::free_udp_port();
    return run_program(folder,
                       fmt::format("commission --plant emulator --node 127.0.0.1:{} --rig rig.toml --yes --out out "
                                   "--format json",
                                   port),
                       emulator_with("valves:swapped@0", port));
  };
  const ProgramRun run = undisturbed(folder, make, node_left_alone);
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_THAT(run.err, HasSubstr("FOUND the valves of chambers A and B are swapped"));
  const auto record = nlohmann::json::parse(text_of(folder / "out/commission.json"));
  std::map<std::string, std::string> verdicts;
  for (const auto& step : record.at("steps")) verdicts[step.at("name")] = step.at("verdict");
  EXPECT_EQ(verdicts.at("link"), "passed");
  EXPECT_EQ(verdicts.at("motor"), "passed");
  EXPECT_EQ(verdicts.at("coils"), "failed");
  EXPECT_EQ(verdicts.at("supply"), "skipped");
  EXPECT_EQ(nlohmann::json::parse(run.out).at("findings").size(), 1u);
}

TEST(CommissionProgram, CtrlCLeavesSafeOutputsAndTheRecord) {
  const Folder folder;
  const auto make = [&] {
    const int port = test::free_udp_port();
    return run_program(
        folder, fmt::format("commission --plant emulator --node 127.0.0.1:{} --rig rig.toml --yes --out out", port),
        emulator_with("pressure_a:offset=0@0", port) + "timeout --preserve-status -s INT 4");
  };
  const ProgramRun run = undisturbed(folder, make, [](const ProgramRun& made) {
    return node_left_alone(made) || made.out.find("coils") != std::string::npos;  // it was faster than the signal
  });
  EXPECT_EQ(run.exit_code, 130) << run.err;
  EXPECT_THAT(run.out, HasSubstr("interrupted: outputs safe"));
  const auto steps = nlohmann::json::parse(text_of(folder / "out/commission.json")).at("steps");
  ASSERT_FALSE(steps.empty());
  EXPECT_EQ(steps.at(0).at("name"), "link");
}

TEST(CommissionProgram, RehearsesOnTheTwinAndRefusesWhatItCannotDo) {
  const Folder folder;
  const std::string out = folder.file("out");
  const ProgramRun run = run_program({"commission", "--out", out});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("nothing found"));
  const auto refused = [&](std::vector<std::string> arguments, const char* because) {
    arguments.insert(arguments.begin(), "commission");
    const ProgramRun bad = run_program(arguments);
    EXPECT_EQ(bad.exit_code, 2) << bad.out;
    EXPECT_THAT(bad.err, HasSubstr(because));
  };
  refused({"--out", out}, "is there already");
  refused({"--out", out, "--from", "leaks"}, "'leaks' is no step (allowed: link, sensors");
  refused({"--out", out, "--step", "coils", "--from", "coils"}, "one of the two");
  refused({"--out", out, "--step", "coils", "--variant", "thesis_pd"}, "is of variant 'nine_state'");
  refused({"--variant", "flyer_single"}, "solenoid check --plant sim --variant flyer_single");
  refused({"--variant", "servo_robust", "--out", folder.file("servo")}, "(allowed: two_way, three_way)");
  refused({"--out", out, "--step", "coils", "--plant", "emulator", "--yes"}, "on plant sim (allowed: the same");
  refused({"--plant", "emulator"}, "there is no terminal to ask at");
  refused({"--plant", "emulator", "--fault", "valves:swapped@0"}, "only with --plant sim");
  refused({"--fault", "valves:turned@0"}, "is not known");
  const ProgramRun again = run_program({"commission", "--out", out, "--from", "delays"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, testing::Not(HasSubstr("coils:")));
  EXPECT_EQ(nlohmann::json::parse(text_of(out + "/commission.json")).at("steps").size(), 11u);
  const ProgramRun nothing = run_program({"commission", "--out", folder.file("later"), "--from", "leak"});
  EXPECT_EQ(nothing.exit_code, 1) << nothing.out;  // no step before it has passed
  EXPECT_THAT(nothing.out, HasSubstr("not done: leak, supply"));
  folder.write("out/commission.json", "{}");
  refused({"--out", out, "--from", "delays"}, "what commission has written");
}

}  // namespace
}  // namespace solenoid
