#include "controllers/instances/instance_set.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/rig/fault_table.hpp"
#include "experiments/rig/log/recorded_run.hpp"
#include "experiments/rig/replay_run.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/rig/undisturbed.hpp"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <optional>
#include <regex>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using test::patient_limits;
using test::ProgramRun;
using test::run_program;
using test::stood_still;
using test::text_of;
using test::undisturbed;
using testing::AnyOf;
using testing::HasSubstr;

std::string log_of(const Folder& folder) { return (folder / "out/cycloidal--nine_state--s1.mcap").string(); }

ProgramRun run_undisturbed(const Folder& folder, std::vector<std::string> arguments) {
  arguments.insert(arguments.end(), {"--rig", folder.file("rig.toml")});
  return undisturbed(folder, [&] { return run_program(arguments); });
}

TEST(Run, MovesTheTwinInRealTimeAndItsReplayGivesTheSameCommands) {
  const Folder folder;
  const ProgramRun run = run_undisturbed(folder, {"run", "nine_state", "--plant", "sim", "--duration", "2.5", "--out",
                                                  (folder / "out").string(), "--quiet", "--format", "json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto result = nlohmann::json::parse(run.out).at("runs").at(0);
  EXPECT_EQ(result.at("status"), "ok");
  const std::int64_t ticks = result.at("loop").at("ticks"), skipped = result.at("loop").at("skipped");
  EXPECT_NEAR(static_cast<double>(ticks + skipped), 2527, 2);  // every millisecond is accounted for
  EXPECT_EQ(result.at("loop").at("allocations"), 0);
  EXPECT_LT(result.at("rmse_mm"), 5.0);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/runs.csv"));
  RecordedRun log = read_run(log_of(folder));
  EXPECT_EQ(log.problem, "");
  EXPECT_EQ(static_cast<std::int64_t>(log.ticks.size()), ticks);
  const ProgramRun replay = run_program({"replay", log_of(folder), "--format", "json"});
  EXPECT_EQ(replay.exit_code, 0) << replay.out << replay.err;
  EXPECT_EQ(nlohmann::json::parse(replay.out).at("coil_differences"), 0);
  const ProgramRun other = run_program({"replay", log_of(folder), "--variant", "thesis_pd_ekf", "--format", "json"});
  EXPECT_EQ(other.exit_code, 0) << other.err;
  EXPECT_GT(nlohmann::json::parse(other.out).at("coil_differences"), 0);
  const std::string instances = (folder / "log.instances").string();
  const ProgramRun profile =
      run_program({"profile", log_of(folder), "--variant", "nine_state,nine_robust", "--per-variant", "50", "--record",
                   instances, "--passes", "1", "--format", "json"});
  EXPECT_EQ(profile.exit_code, 0) << profile.err;
  const InstanceSet posed = read_instances(instances);
  ASSERT_EQ(posed.variants.size(), 2u);
  for (const VariantInstances& v : posed.variants) {
    EXPECT_GE(v.records.size(), 25u);
    for (const InstanceRecord& r : v.records) EXPECT_EQ(!r.load.empty(), v.name == "nine_robust");
  }
  const ProgramRun csv = run_program({"export", log_of(folder)});
  EXPECT_EQ(std::count(csv.out.begin(), csv.out.end(), '\n'), ticks + 1);
  log.ticks.back().applied.switches = 0b10000;  // of four
  EXPECT_THROW(replay_same(log, recorded_task(log)), ConfigError);
}

TEST(Run, NextSlotPlansTakeEffectAtSlotsAlone) {
  const Folder folder;
  const ProgramRun run =
      run_undisturbed(folder, {"run", "nine_state", "--plant", "sim", "--duration", "2.5", "--policy", "next_slot",
                               "--out", (folder / "out").string(), "--quiet"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  SwitchPattern before = 0;
  for (const TickRecord& t : read_run(log_of(folder)).ticks) {
    const auto k = std::llround(t.sensors.time_s / 1e-3);
    if (t.decision.rung == Rung::fresh && t.skipped == 0) {
      EXPECT_TRUE(t.applied.switches == before || k % 5 == 0) << k;
    }
    before = t.applied.switches;
  }
  EXPECT_EQ(run_program({"replay", log_of(folder)}).exit_code, 0);
}

#ifdef SOLENOID_STEPPED_CLOCK
TEST(Run, DoesNotNoticeThatTheWallClockIsSetBack) {
  const Folder folder;
  const std::string report = folder.file("report");
  setenv("STEPPED_CLOCK_REPORT", report.c_str(), 1);
  setenv("LD_PRELOAD", SOLENOID_STEPPED_CLOCK, 1);
  const ProgramRun run = run_undisturbed(
      folder, {"run", "nine_state", "--plant", "sim", "--duration", "2.5", "--out", folder.file("out"), "--quiet"});
  unsetenv("LD_PRELOAD");
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(text_of(report), HasSubstr("an hour back"));  // somebody did look at it
  const RecordedRun log = read_run(log_of(folder));
  EXPECT_EQ(log.problem, "");
  std::int64_t last = -1;
  for (const TickRecord& t : log.ticks) {
    const auto k = std::llround(t.sensors.time_s / 1e-3);
    EXPECT_EQ(k, last + 1 + t.skipped);  // every millisecond once, none twice
    last = k;
  }
  EXPECT_GT(last, 2400);
}
#endif

TEST(Run, EndsInSafeWithExitCodeOneWhenASensorFails) {
  const Folder folder;
  const ProgramRun run = run_undisturbed(folder, {"run", "nine_state", "--duration", "3", "--fault",
                                                  "position:garbage@1", "--out", (folder / "out").string(), "--quiet"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.out, HasSubstr("position"));
  EXPECT_EQ(read_run(log_of(folder)).ticks.back().applied, Command{});
  EXPECT_TRUE(std::filesystem::exists(folder / "out/cycloidal--nine_state--s1-fault-1.csv"));
}

TEST(Run, OnlyTheNodesKeyOpensIt) {
  const Folder folder;
  for (const char* key : {"right", "wrong"}) {
    folder.write(key, std::string(31, '0') + (key[0] == 'r' ? "1" : "2") + "\n");
    std::filesystem::permissions(folder / key, std::filesystem::perms::owner_read);
  }
  folder.write("rig.toml", fmt::format("{}[node]\nkey_file = 'right'\n", patient_limits));
  const int port = test::free_udp_port();
  const std::string to = fmt::format("--plant emulator --node 127.0.0.1:{}", port);
  const ProgramRun run = run_program(
      folder, fmt::format("run nine_state {} --rig rig.toml --duration 0.5 --quiet --out out", to),
      fmt::format(
          "{{ '{}' emulator --port {} --key right --idle-exit 20 --report node.json & }} 2>node.txt; sleep 0.5;",
          SOLENOID_PROGRAM, port));
  EXPECT_THAT(run.out, HasSubstr("0 corrupt")) << run.err;
  for (const char* with : {"", "--key wrong"}) {
    const ProgramRun check = run_program(folder, fmt::format("check {} {}", to, with));
    EXPECT_EQ(check.exit_code, 2);
    EXPECT_THAT(check.err,
                HasSubstr(with[0] == '-' ? "no answer within 3 s (is `solenoid emulator` running, with the same key?"
                                         : "no answer within 3 s (is `solenoid emulator` running, without a key?"));
  }
}

/// A coil of the emulated bank sticks: the run finds it, says so in its log, and goes on to its end without it.
TEST(Run, DoesWithoutACoilThatSticksOnTheEmulator) {
  const Folder folder;
  folder.write("health.toml", R"(
variants = ["watched"]
[variant.watched]
summary  = "nine states, coils watched"
valves   = "two_way"
solver   = "branch_and_bound"
horizon  = { steps = 100, blocks = [4, 16] }
cost     = { position = 1.0, switching = 2e-8 }
motor    = "in_prediction"
valve_health = true
[[scenario]]
name       = "moving"
trajectory = { kind = "sine", frequency_hz = 0.5, lead_s = 1.0 }
plant      = "twin"
noise      = true
)");
  const auto log = [&] { return read_run(folder.file("out/moving--watched--s1.mcap")).ticks; };
  const auto make = [&] {
    const int port = test::free_udp_port();
    return run_program(
        folder,
        fmt::format(
            "run watched --campaign health.toml --plant emulator --node 127.0.0.1:{} --rig rig.toml --duration 3 "
            "--quiet --out out",
            port),
        fmt::format("{{ '{}' emulator --campaign health.toml --variant watched --port {} --fault "
                    "coil_exhaust_a:stuck_open@1.5 --idle-exit 20 --report node.json & }} 2>node.txt; sleep 0.5;",
                    SOLENOID_PROGRAM, port));
  };
  // A coil that fails within 150 ms of a missed tick is not looked for: SAFE follows as it would without `valve_health`.
  const auto missed = [](const TickRecord& t) { return t.skipped > 0 || t.sensors.stale_ticks > 0; };
  const ProgramRun run = undisturbed(folder, make, [&](const ProgramRun& made) {
    return stood_still(made) || (made.exit_code != 0 && std::ranges::any_of(log(), missed));
  });
  EXPECT_EQ(run.exit_code, 0) << run.err << run.out;
  const auto ticks = log();
  ASSERT_GT(ticks.size(), 2000u);
  bool named = false;
  for (const TickRecord& t : ticks) {
    if (t.decision.failed_switch < 0) continue;
    if (!named) {
      EXPECT_GT(t.sensors.time_s, 1.0);  // the node's time began when its session did, before the run's
    }
    named = true;
    EXPECT_EQ(t.decision.failed_switch, 1);
    EXPECT_GT(t.decision.mode_set, 0);
    EXPECT_EQ((t.applied.switches >> 1) & 1u, 0u);
  }
  EXPECT_TRUE(named);
}

/// A disk of a megabyte: the log fills it, the run ends in SAFE for it, and everybody is told.
TEST(Run, AFullDiskHidesNeitherSafeNorItsCause) {
  const Folder folder;
  const std::string script =
      "cd '" + folder.path() +
      "' && mkdir disk && mount -t tmpfs -o size=1m none disk && touch mounted && { '" SOLENOID_PROGRAM
      "' run nine_state --duration 4 --quiet --out disk/out --format json >out.json 2>err.txt; "
      "echo $? >code; cp disk/out/manifest.json disk/out/runs.csv disk/out/*.mcap .; }";
  folder.write("run.sh", script);
  [[maybe_unused]] const int status =
      std::system(("unshare -m sh '" + folder.file("run.sh") + "' 2>/dev/null").c_str());
  if (!std::filesystem::exists(folder / "mounted")) GTEST_SKIP() << "no file system can be mounted here";
  EXPECT_EQ(text_of(folder / "code"), "1\n") << text_of(folder / "err.txt");
  const auto run = nlohmann::json::parse(text_of(folder / "out.json")).at("runs").at(0);
  EXPECT_THAT(run.at("status").get<std::string>(), HasSubstr("No space left on device"));
  EXPECT_GT(run.at("loop").at("ticks"), 100);
  EXPECT_EQ(nlohmann::json::parse(text_of(folder / "manifest.json")).at("status"), "failed");
  EXPECT_THAT(text_of(folder / "runs.csv"), HasSubstr("No space left on device"));
  EXPECT_GT(read_run(folder.file("cycloidal--nine_state--s1.mcap")).ticks.size(), 100u);
}

TEST(Run, RefusesBeforeItMovesAnything) {
  const Folder folder;
  const std::string out = (folder / "out").string();
  EXPECT_EQ(run_program({"run", "nobody", "--out", out}).exit_code, 2);
  EXPECT_EQ(run_program({"run", "nine_state", "--fault", "position:on@1", "--out", out}).exit_code, 2);
  EXPECT_EQ(run_program({"run", "nine_state", "--plant", "hydraulic", "--out", out}).exit_code, 2);
  EXPECT_EQ(run_program({"run", "nine_state", "--out", "/proc/nowhere"}).exit_code, 2);
  EXPECT_EQ(run_program({"run", "nine_state", "--fault", "solver:throw@0", "--out", out}).exit_code, 1);
  const ProgramRun none =
      run_program({"run", "nine_state", "--plant", "emulator", "--node", "127.0.0.1:9", "--out", out});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("no answer"));
}

#if SOLENOID_TEST_ONE_IN == 1  // a sanitizer makes calls of its own
TEST(Run, TheTickMakesNoSystemCallButSleepOnTheTwin) {
  if (std::system("strace -V >/dev/null 2>&1") != 0) GTEST_SKIP() << "needs strace";
  const Folder folder;
  const std::string trace = (folder / "trace").string();
  const std::string command = "strace -f -qq -o '" + trace +
                              "' " SOLENOID_PROGRAM " run nine_state --duration 1 --quiet --out '" +
                              (folder / "out").string() + "' >/dev/null 2>&1";
  const int status = std::system(command.c_str());
  if (!WIFEXITED(status) || WEXITSTATUS(status) > 1) GTEST_SKIP() << "strace may not trace here";
  std::istringstream lines(text_of(trace));
  std::map<std::string, std::map<std::string, int>> calls;  // by thread
  std::map<std::string, std::string> names;
  const std::regex call(R"(^(\d+)\s+(?:<\.\.\. )?(\w+))"), named("PR_SET_NAME, \"(\\w+)\"");
  std::smatch m;
  std::map<std::string, bool> ticking;
  for (std::string line; std::getline(lines, line);) {
    if (!std::regex_search(line, m, call)) continue;
    const std::string thread = m[1], name = m[2];
    if (std::smatch n; std::regex_search(line, n, named)) names[thread] = n[1];
    if (name == "clock_nanosleep") ticking[thread] = true;  // set-up is over with the first sleep
    if (ticking[thread]) ++calls[thread][name];
  }
  bool found = false;
  for (const auto& [thread, name] : names) {
    if (name != "tick") continue;
    found = true;
    int others = 0;
    for (const auto& [what, count] : calls[thread])
      if (what != "clock_nanosleep" && what != "exit" && what != "madvise" && what != "munmap" &&
          what != "rt_sigprocmask")
        others += count, ADD_FAILURE() << what << " " << count;
    EXPECT_GT(calls[thread]["clock_nanosleep"], 20);
    EXPECT_EQ(others, 0);
  }
  EXPECT_TRUE(found);
}
#endif

TEST(Faults, OfProcessesLeaveTheNodeSafeAndTheLogReadable) {
  const Folder folder;
  for (const ProcessOutcome& p : process_faults(SOLENOID_PROGRAM, (folder / "").string(), "nine_state")) {
    SCOPED_TRACE(p.name + ": " + p.causes);
    EXPECT_EQ(p.refused, 0);
    EXPECT_EQ(p.final_outputs, Command{});
    EXPECT_EQ(p.node_exit_code, p.name == "node killed" ? 128 + SIGKILL : 0);
    // Where the machine itself stood still, SAFE came first and says so.
    const bool stood_still = p.causes.find("stale") != std::string::npos || p.causes.find("gap") != std::string::npos ||
                             p.causes.find("I/O safe") != std::string::npos;
    const bool asked_too = p.name == "another controller asks";
    if (!asked_too || !stood_still) {  // whoever asks has the node once the first is done with it
      EXPECT_EQ(p.sessions, p.name == "node killed" ? 0 : 1);  // which its report tells
    }
    if (!stood_still) {
      EXPECT_GT(p.log_ticks, 100);
    }
    const bool no_disk = p.name == "disk full" || p.name == "disk read-only";
    const bool killed = p.name == "SIGKILL" || p.name == "SIGSEGV" || p.name == "SIGXCPU" || no_disk;
    if (no_disk) {
      EXPECT_EQ(p.exit_code, 1);
    }
    if (p.name == "disk 300 ms slow" && !stood_still) {
      EXPECT_EQ(p.exit_code, 0);                                        // the tick does not wait for it
      EXPECT_GT(p.log_ticks, SOLENOID_TEST_ONE_IN == 1 ? 2900 : 2000);  // under sanitizers ticks are left out
    }
    if (!stood_still) {
      EXPECT_EQ(p.log_closed, !killed);
    }
    if ((p.name == "SIGINT" || p.name == "SIGTERM" || p.name.starts_with("SIGQUIT")) && !stood_still) {
      EXPECT_EQ(p.exit_code, 130);
    }
    if ((p.name.starts_with("SIG") || p.name == "nothing") && p.name != "SIGKILL" && !stood_still) {
      EXPECT_EQ(p.safe_after_ms, -1);  // the node never had to help itself: from the session's begin to its end
    }
    if (p.name == "SIGKILL" || p.name == "every packet lost") {
      EXPECT_GT(p.safe_after_ms, 18.9);
      EXPECT_LT(p.safe_after_ms, SOLENOID_TEST_ONE_IN == 1 ? 100 : 500);  // 20, and what a shared machine takes
    }
    if (p.name.starts_with("SIGTSTP") && !stood_still) {
      EXPECT_EQ(p.exit_code, 0);
    }
    const bool in_time = !test::sanitized || p.asked > 0;  // else a sanitized program asks when the run is over
    if (asked_too && !stood_still && in_time) {
      EXPECT_GE(p.asked, 2);
      EXPECT_EQ(p.exit_code, 0);
      for (const char* who : {"check", "second"})
        EXPECT_THAT(text_of(fmt::format("{}-{}.txt", p.results, who)),
                    HasSubstr("another controller has it: 127.0.0.1:"));
    }
    if (p.name.starts_with("SIGSTOP")) {
      EXPECT_EQ(p.exit_code, 1);
      EXPECT_TRUE(stood_still) << p.causes;
    }
    // Samples that are late, overtake each other or are lost: estimators are told their age.
    if ((p.name.starts_with("packets ") || p.name.starts_with("the same, ")) && !stood_still) {
      EXPECT_EQ(p.exit_code, 0);
    }
    if (p.name == "node killed" || p.name == "every packet lost") {
      EXPECT_EQ(p.exit_code, 1);
      EXPECT_THAT(p.causes, AnyOf(HasSubstr("stale"), HasSubstr("gap")));
    }
    if (p.name == "solver hangs" && !stood_still) {
      EXPECT_THAT(p.causes, HasSubstr("no plan"));
    }
  }
}

#ifdef SOLENOID_FAKE_COMEDI
ProgramRun run_comedi(const Folder& folder, const std::string& fault) {
  folder.write("rig.toml", std::string(patient_limits) +
                               "[comedi]\nvalves = { subdevice = 3, coils = [0, 1, 2, 3], watchdog = 15 }\n");
  setenv("LD_LIBRARY_PATH", SOLENOID_FAKE_COMEDI, 1);
  setenv("FAKE_COMEDI", fault.c_str(), 1);
  setenv("FAKE_COMEDI_REPORT", (folder / "report").c_str(), 1);
  ProgramRun run = run_undisturbed(folder, {"run", "nine_state", "--plant", "comedi", "--duration", "3", "--out",
                                            (folder / "out").string(), "--quiet"});
  unsetenv("LD_LIBRARY_PATH");
  return run;
}

TEST(Comedi, ClosesTheLoopThroughASubstituteBoard) {
  const Folder folder;
  const ProgramRun run = run_comedi(folder, "");
  ASSERT_EQ(run.exit_code, 0) << run.out << run.err;
  const RecordedRun log = read_run(log_of(folder));
  double largest_mm = 0.0;
  for (const TickRecord& t : log.ticks) {
    if (t.decision.safe_causes.has(Fault::stopped) || t.skipped > 20) break;  // no loop holds what is not looked at
    largest_mm =
        std::max(largest_mm, 1e3 * std::abs(t.decision.reference.axis[0].value - t.sensors.value[position_channel]));
    const double level = (t.sensors.value[position_channel] - 0.05) / 0.012 / (10.0 / 8191) + 4095.5;
    ASSERT_NEAR(level, std::round(level), 1e-6);  // the card's own steps
  }
  EXPECT_LT(largest_mm, 5.0);
  const std::string report = text_of(folder / "report");
  EXPECT_THAT(report, HasSubstr("coils  0 motor_v   0.00"));
  std::smatch m;
  ASSERT_TRUE(std::regex_search(report, m, std::regex("toggles +(\\d+)")));
  EXPECT_GE(std::stol(m[1]) + 1, std::ssize(log.ticks));  // every tick fed the external watchdog
}

TEST(Comedi, AFailingReadEndsInTheSafeState) {
  const Folder folder;
  const ProgramRun run = run_comedi(folder, "fail@1000");
  EXPECT_EQ(run.exit_code, 1) << run.out << run.err;
  EXPECT_THAT(text_of(folder / "report"), HasSubstr("coils  0 motor_v   0.00"));
  EXPECT_THAT(run.out, HasSubstr("stale"));
}

TEST(Comedi, AReadThatNeverComesBackEndsInTheSafeStateAndNotInAHang) {
  const Folder folder;
  const ProgramRun run = run_comedi(folder, "block@1000");
  EXPECT_EQ(run.exit_code, 1) << run.out << run.err;
  EXPECT_THAT(run.err, HasSubstr("did not come back"));
  EXPECT_THAT(text_of(folder / "report"), HasSubstr("coils  0 motor_v   0.00"));
  EXPECT_EQ(read_run(log_of(folder)).problem, "");
}
#endif

}  // namespace
}  // namespace solenoid
