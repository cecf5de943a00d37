// Runs in real time, their logs, replays and exports, of systems that are not the actuator.
#include "controllers/systems.hpp"
#include "experiments/rig/log/recorded_run.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <algorithm>
#include <ostream>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using test::free_udp_port;
using test::ProgramRun;
using test::refusal_of;
using test::run_program;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// A variant, another of its system, and what its logs call things.
struct Case {
  std::string variant, scenario, other, switches, column;
};

/// In the names of tests.
std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.variant; }

class AnySystemRun : public testing::TestWithParam<Case> {};

TEST_P(AnySystemRun, RunsInRealTimeAndItsReplayGivesTheSameCommands) {
  const Case& c = GetParam();
  const Folder folder;
  folder.write("rig.toml", "[limits]\nlongest_gap_ms = 1000\n");  // a shared machine may stand still for long
  const ProgramRun run = run_program({"run", c.variant, "--duration", "2", "--quiet", "--rig", folder.file("rig.toml"),
                                      "--out", folder.file("out"), "--format", "json"});
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  const auto result = nlohmann::json::parse(run.out).at("runs").at(0);
  EXPECT_EQ(result.at("status"), "ok");
  EXPECT_EQ(result.at("loop").at("allocations"), 0);
  const std::string log = folder.file("out/" + c.scenario + "--" + c.variant + "--s1.mcap");
  const RecordedRun recorded = read_run(log);
  EXPECT_EQ(recorded.problem, "");
  EXPECT_EQ(recorded.system->name, result.at("system"));
  const ProgramRun replay = run_program({"replay", log, "--format", "json"});
  EXPECT_EQ(replay.exit_code, 0) << replay.out << replay.err;
  const auto replayed = nlohmann::json::parse(replay.out);
  if (!test::sanitized || replayed.at("unproven") == 0) {  // no replay finds a plan that the clock cut short
    EXPECT_EQ(replayed.at(c.switches), 0) << "plans that the clock cut short: " << replayed.at("unproven");
  }
  if (!c.other.empty()) {
    const ProgramRun other = run_program({"replay", log, "--variant", c.other, "--format", "json"});
    EXPECT_EQ(other.exit_code, 0) << other.err;
  }
  const ProgramRun foreign = run_program({"replay", log, "--variant", "thesis_pd"});
  EXPECT_EQ(foreign.exit_code, 2);
  EXPECT_THAT(foreign.err, HasSubstr("allowed: a variant of the log's system"));
  const ProgramRun csv = run_program({"export", log});
  EXPECT_EQ(csv.exit_code, 0) << csv.err;
  EXPECT_THAT(csv.out.substr(0, csv.out.find('\n')), HasSubstr(c.column));
  EXPECT_EQ(std::count(csv.out.begin(), csv.out.end(), '\n'), static_cast<long>(recorded.ticks.size()) + 1);
}

INSTANTIATE_TEST_SUITE_P(All, AnySystemRun,
                         testing::Values(Case{"flyer_single", "manoeuvre", "flyer_pairs", "thruster_differences",
                                              "true_angle_rad"},
                                         Case{"slow_inverter", "slow_motion", "", "gate_differences", "i_alpha_a"}),
                         [](const auto& info) { return info.param.variant; });

/// Its node speaks of its own channels, and one of another system is no node for it.
TEST(AnySystemNode, CarriesTheSystemsOwnChannels) {
  const Folder folder;
  for (const auto& [variant, port] :
       {std::pair("flyer_single", free_udp_port()), std::pair("slow_inverter", free_udp_port())}) {
    const std::string at = fmt::format("--node 127.0.0.1:{}", port);
    const ProgramRun run = run_program(
        folder,
        fmt::format("run {} --plant emulator {} --duration 0.5 --quiet --format json --out {}", variant, at, variant),
        fmt::format(
            "{{ '{}' emulator --variant {} --port {} --idle-exit {} --report node.json & }} 2>emulator.txt; sleep 0.5;",
            SOLENOID_PROGRAM, variant, port, test::sanitized ? 20 : 3));
    EXPECT_TRUE(run.exit_code == 0 || run.exit_code == 1) << run.err;
    EXPECT_THAT(run.err, Not(HasSubstr("not plausible")));
    EXPECT_THAT(refusal_of(folder, fmt::format("run nine_state --plant emulator {} --out other", at)),
                AllOf(HasSubstr("I/O node"), HasSubstr("it is of \""), HasSubstr("position [m]")));
  }
}

TEST(AnySystemFaults, AChannelFailsByScriptAndEndsInSafe) {
  const Folder folder;
  const ProgramRun run = run_program({"run", "flyer_single", "--duration", "3", "--quiet", "--fault", "x:stuck@0.5",
                                      "--fault", "y:off@1", "--out", folder.file("out"), "--format", "json"});
  EXPECT_EQ(run.exit_code, 1) << run.err << run.out;
  const ProgramRun bad =
      run_program({"run", "flyer_single", "--fault", "pressure_a:off@1", "--out", folder.file("o2")});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_THAT(bad.err, HasSubstr("sensor one of x, y, angle"));
}

}  // namespace
}  // namespace solenoid
