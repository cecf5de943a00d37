#include "experiments/rig/soak.hpp"

#include "controllers/factory.hpp"
#include "core/rt/clock.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/busy_threads.hpp"
#include "experiments/base/child_process.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/campaign.hpp"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <fstream>

#include <fmt/format.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr double settled_s = 4.0;       // until then processes start
constexpr double growth_kb = 1024.0;    // that counts as none
constexpr double index_kb_per_s = 1.0;  // the log's, written when it ends: 0.2 kB a chunk, of which a second has four
constexpr int interrupted_code = 130;

std::int64_t resident_kb(pid_t process) {
  std::ifstream in(fmt::format("/proc/{}/statm", process));
  std::int64_t size = 0, resident = 0;
  in >> size >> resident;
  return resident * (::sysconf(_SC_PAGESIZE) / 1024);
}

Percentiles percentiles_of(const Json& json) {
  return {json.at("p50"), json.at("p90"), json.at("p99"), json.at("p999"), json.at("max")};
}

void take_result(const std::string& path, double tick_s, SoakOutcome& outcome) {
  const std::string text = read_whole_file(path).value_or("");
  const std::size_t begin = text.find("{\n");
  if (begin == std::string::npos) throw OutputError("the run said nothing of itself: " + text);
  const Json run = parse_json(text.substr(begin), path).at("runs").at(0);
  const Json& loop = run.at("loop");
  outcome.ticks = loop.at("ticks");
  outcome.skipped = loop.at("skipped");
  outcome.late = loop.at("late");
  outcome.due = std::lround(loop.at("ended_s").get<double>() / tick_s) + 1;
  const Json& ladder = run.at("ladder");
  outcome.safe_entries = ladder.at("safe_entries");
  outcome.safe_slots = ladder.at("safe");
  outcome.causes = run.at("safe_causes");
  outcome.late_us = percentiles_of(run.at("timing_us").at("late"));
  outcome.tick_us = percentiles_of(run.at("timing_us").at("tick"));
}

void judge(double tick_s, bool as_told, SoakOutcome& outcome) {
  const auto find = [&](const std::string& what) { outcome.findings.push_back(what); };
  if (!as_told) find(fmt::format("ended with {}: {}", outcome.exit_code, outcome.causes));
  if (outcome.ticks + outcome.skipped != outcome.due)
    find(fmt::format("{} ticks done and {} skipped of {} that were due", outcome.ticks, outcome.skipped, outcome.due));
  if (outcome.late_us.p50 > 0.5e6 * tick_s)
    find(fmt::format("half the ticks began {:.0f} us late", outcome.late_us.p50));
  const double from_s = std::max(settled_s, outcome.looks.empty() ? 0.0 : 0.1 * outcome.looks.back().time_s);
  const auto settled = std::ranges::find_if(outcome.looks, [&](const auto& look) { return look.time_s >= from_s; });
  for (const auto member : {&SoakOutcome::Look::run_kb, &SoakOutcome::Look::node_kb}) {
    const auto grew = std::ranges::find_if(settled, outcome.looks.end(), [&](const auto& look) {
      const double allowed_kb = growth_kb + index_kb_per_s * (look.time_s - settled->time_s);
      return static_cast<double>(look.*member - *settled.*member) > allowed_kb;
    });
    if (grew != outcome.looks.end())
      find(fmt::format("memory grew from {} kB at {:.0f} s to {} kB at {:.0f} s", *settled.*member, settled->time_s,
                       *grew.*member, grew->time_s));
  }
}

/// What became of a run that has ended; one that was interrupted may have had nothing to say yet.
void look_at_end(const std::string& said, double tick_s, bool interrupted, SoakOutcome& outcome) {
  const bool as_told = outcome.exit_code == 0 || (interrupted && outcome.exit_code == interrupted_code);
  try {
    take_result(said, tick_s, outcome);
  } catch (const std::exception& error) {
    if (!interrupted || !as_told)
      outcome.findings.push_back(fmt::format("ended with {}: {}", outcome.exit_code, error.what()));
    return;
  }
  judge(tick_s, as_told, outcome);
}

}  // namespace

SoakOutcome soak(const SoakSettings& settings, const std::function<bool()>& interrupted,
                 const std::function<void(const SoakOutcome::Look&)>& tell) {
  const double tick_s = shipped_variant(settings.variant).timing.tick_s;
  create_folder(settings.folder);
  const auto file = [&](const char* name) { return settings.folder + "/" + name; };
  const std::string port = std::to_string(20000 + ::getpid() % 20000);
  write_file_atomically(file("rig.toml"),
                        "[limits]\nlongest_gap_ms = 1000\n");  // standing still is counted, not ended for
  Child node(settings.program, {"emulator", "--variant", settings.variant, "--port", port, "--idle-exit", "2"},
             file("node.json"));
  wait_s(0.5);
  Child run(settings.program,
            {"run", settings.variant, "--plant", "emulator", "--node", "127.0.0.1:" + port, "--duration",
             fmt::format("{}", settings.duration_s), "--rig", file("rig.toml"), "--out", file("run"), "--quiet",
             "--format", "json", "--rearm-wait", "3600"},
            file("run.json"), [] { std::signal(SIGUSR1, SIG_IGN); });  // until it listens for it
  const BusyThreads load(settings.load);
  SoakOutcome outcome;
  MonotonicClock clock;
  const double look_s = std::clamp(settings.duration_s / 30, 0.2, 60.0);
  double rearm_s = settled_s, due_s = settings.duration_s;
  bool told_to_end = false;
  for (double next_s = 1.0; run.runs(); wait_s(0.05)) {
    if (interrupted()) {
      run.send(SIGINT);  // again and again: its program may not have begun yet
      told_to_end = true;
      due_s = std::min(due_s, clock.now_s());
    }
    if (clock.now_s() > due_s + settings.overtime_s) {
      outcome.findings.push_back(fmt::format("had to be killed {:.0f} s after its time", settings.overtime_s));
      return outcome;
    }
    if (clock.now_s() > rearm_s) run.send(SIGUSR1), rearm_s = clock.now_s() + 1.0;  // does nothing where it is not SAFE
    if (clock.now_s() < next_s) continue;
    next_s = clock.now_s() + look_s;
    const SoakOutcome::Look look{clock.now_s(), resident_kb(run.id()), resident_kb(node.id())};
    if (look.run_kb == 0 || look.node_kb == 0 || look.time_s > settings.duration_s) continue;  // it ends
    outcome.looks.push_back(look);
    tell(look);
  }
  outcome.exit_code = run.wait(1.0);
  look_at_end(file("run.json"), tick_s, told_to_end, outcome);
  return outcome;
}

Result result_of(const SoakOutcome& outcome) {
  using Column = Table::Column;
  const auto numbers = [](const Percentiles& p) {
    return Json{{"p50", p.p50}, {"p90", p.p90}, {"p99", p.p99}, {"p999", p.p999}, {"max", p.max}};
  };
  Table looks{.name = "looks",
              .columns = {Column("time_s", "s", ".0f"), Column("run_kb", "run kB"), Column("node_kb", "node kB")}};
  for (const SoakOutcome::Look& look : outcome.looks) looks.add({look.time_s, look.run_kb, look.node_kb});
  Result result{.facts = {{"exit_code", outcome.exit_code},
                          {"safe_causes", outcome.causes},
                          {"ticks", outcome.ticks},
                          {"skipped", outcome.skipped},
                          {"late", outcome.late},
                          {"due", outcome.due},
                          {"safe_entries", outcome.safe_entries},
                          {"safe_slots", outcome.safe_slots},
                          {"late_us", numbers(outcome.late_us)},
                          {"tick_us", numbers(outcome.tick_us)},
                          {"findings", outcome.findings}},
                .tables = {looks}};
  result.notes.push_back(fmt::format(
      "{} ticks done, {} skipped, of {} due; {} ended late; {} times in SAFE, its end included, {} slots of it",
      outcome.ticks, outcome.skipped, outcome.due, outcome.late, outcome.safe_entries, outcome.safe_slots));
  for (const auto& [name, p] : {std::pair("begun late", outcome.late_us), {"took", outcome.tick_us}})
    result.notes.push_back(
        fmt::format("{}: p50 {:.0f}, p99 {:.0f}, p99.9 {:.0f}, max {:.0f} us", name, p.p50, p.p99, p.p999, p.max));
  for (const std::string& what : outcome.findings) result.notes.push_back("FOUND " + what);
  if (outcome.findings.empty()) result.notes.emplace_back("nothing found");
  return result;
}

}  // namespace solenoid
