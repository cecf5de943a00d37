#include "core/systems/actuator/signals.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/busy_threads.hpp"
#include "experiments/base/child_process.hpp"
#include "experiments/base/files.hpp"
#include "experiments/rig/fault_table.hpp"
#include "experiments/rig/log/recorded_run.hpp"

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <functional>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr double strike_s = 1.5;        // after the run began its log
constexpr double longest_start_s = 30;  // before that
constexpr double plant_fault_s = 1.5;   // of the plant's time

/// Where a fault strikes.
struct Scene {
  Child& run;
  const std::string &program, &variant, &node, &results;  ///< this program; whose switches the node has; its address
};

struct Case {
  const char* name;
  std::vector<std::string> run_arguments, node_arguments;
  std::function<void(const Scene&)> strike = [](const Scene&) {};
  std::function<void()> before_run = [] {};
  const char* duration = "3";
  bool of_plant = false;  // its detection is timed
};

/// Another controller, and somebody who only looks, ask for the same node.
void ask_too(const Scene& scene) {
  Child looks(scene.program, {"check", "--plant", "emulator", "--node", scene.node}, scene.results + "-check.txt");
  Child drives(scene.program,
               {"run", scene.variant, "--plant", "emulator", "--node", scene.node, "--out", scene.results + "-second"},
               scene.results + "-second.txt");
  for (Child* child : {&looks, &drives}) child->wait(longest_start_s);
}

std::vector<Case> cases() {
  const auto signal = [](int which) { return [which](const Scene& scene) { scene.run.send(which); }; };
  const auto stopped = [](const Scene& scene) {
    scene.run.send(SIGSTOP);
    wait_s(0.1);
    scene.run.send(SIGCONT);
  };
  const auto limited = [] {
    const rlimit limit{300'000, 300'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  };
  const auto hog = [](const Scene&) {
    const BusyThreads busy(4);
    wait_s(0.8);
  };
  return {{"nothing", {}, {}},
          {"SIGINT", {}, {}, signal(SIGINT)},
          {"SIGTERM", {}, {}, signal(SIGTERM)},
          {"SIGQUIT (Ctrl-\\)", {}, {}, signal(SIGQUIT)},
          {"SIGTSTP (Ctrl-Z)", {}, {}, signal(SIGTSTP)},
          {"SIGXCPU", {}, {}, signal(SIGXCPU)},
          {"SIGSEGV", {}, {}, signal(SIGSEGV)},
          {"SIGKILL", {}, {}, signal(SIGKILL)},
          {"SIGSTOP for 100 ms", {}, {}, stopped},
          {"another controller asks", {}, {}, ask_too, [] {}, "8"},
          {"node killed", {}, {"--fault", "process:killed@1"}},
          {"node stands still for 100 ms", {}, {"--fault", "process:stopped=0.1@1"}},
          {"every packet lost", {}, {"--fault", "packets:lost=1@1"}},
          {"5 % of packets lost", {}, {"--fault", "packets:lost=0.05@1"}},
          {"packets 2 ms late", {}, {"--fault", "packets:late=2@1"}},
          {"packets 0 to 2 ms late", {}, {"--fault", "packets:jitter=2@1"}},
          {"the same, 5 % lost", {}, {"--fault", "packets:jitter=2@1", "--fault", "packets:lost=0.05@1"}},
          {"10 % of packets repeated", {}, {"--fault", "packets:repeated=0.1@1"}},
          {"5 % of packets corrupt", {}, {"--fault", "packets:corrupt=0.05@1"}},
          {"disk full", {}, {}, [](const Scene&) {}, limited},
          {"disk read-only", {"--fault", "disk:read_only@2"}, {}},
          {"disk 300 ms slow", {"--fault", "disk:slow=300@1"}, {}},
          {"solver hangs", {"--fault", "solver:hang@1"}, {}},
          {"CPU hog", {}, {}, hog}};
}

/// Of the firmware's image: what a simulated plant's sensors and valves do, in real time. After a second of the
/// plant's.
std::vector<Case> plant_cases() {
  std::vector<Case> list;
  for (const char* what :
       {"position:off", "position:stuck", "position:garbage", "position:offset=0.005", "pressure_a:off",
        "pressure_a:stuck", "pressure_a:garbage", "pressure_b:off", "valves:stuck", "valves:swapped", "supply:lost"}) {
    list.push_back({what, {}, {"--fault", fmt::format("{}@{}", what, plant_fault_s)}});
    list.back().of_plant = true;
  }
  return list;
}

/// How long after the fault's begin by the node's report the controller noticed it.
void time_detection(const RecordedRun& run, std::int64_t node_begun_ns, ProcessOutcome& out) {
  const auto started = run.about.find("start_ns");
  if (started == run.about.end()) return;
  const double fault_s = plant_fault_s - 1e-9 * static_cast<double>(std::stoll(started->second) - node_begun_ns);
  FaultSet known;
  for (const TickRecord& t : run.ticks) {
    const Decision& d = t.decision;
    if (t.sensors.time_s < fault_s) {
      known |= d.faults;
    } else if ((d.faults.bits() & ~known.bits()) != 0 || d.rung != Rung::fresh) {
      out.noticed_ms = 1e3 * (t.sensors.time_s - fault_s);
      return;
    }
  }
}

/// The log's ticks, and whether it was closed.
void look_at_log(const std::string& path, ProcessOutcome& out) {
  try {
    const RecordedRun run = read_run(path);
    out.log_ticks = static_cast<std::int64_t>(run.ticks.size());
    out.log_closed = run.problem.empty();
    const Decision& last = run.ticks.back().decision;
    if (last.rung == Rung::safe) out.causes = to_string(last.safe_causes, *run.system);
  } catch (const std::exception& error) {
    out.causes = error.what();
  }
}

void look_at_node(const std::string& path, ProcessOutcome& out) {
  const auto text = read_whole_file(path);
  if (!text) return;  // it was killed
  const auto report = parse_json(*text, path);
  out.longest_silence_ms = report.at("longest_silence_ms");
  if (report.at("timeouts") > 0) out.safe_after_ms = report.at("safe_after_ms");
  if (const auto board = report.find("board"); board != report.end())
    out.watchdog_resets = board->at("watchdog_resets");
  out.refused = report.at("refused");
  out.sessions = report.at("sessions");
  out.asked = report.at("asked");
  if (const auto outputs = report.find("final_outputs"); outputs != report.end())
    out.final_outputs = actuator_command(outputs->at("coils"), outputs->at("motor_n"));
}

/// When the node's plant began, by the wall clock.
std::int64_t node_begun_ns(const std::string& path) {
  const auto text = read_whole_file(path);
  return text ? parse_json(*text, path).value("begun_ns", std::int64_t{0}) : 0;
}

ProcessOutcome provoke(const Case& c, const std::string& program, const std::string& folder, const std::string& variant,
                       int port, bool image) {
  ProcessOutcome out;
  out.name = c.name;
  const std::string here = fmt::format("{}/{}", folder, port), report = here + "-node.json";
  out.results = here;
  const std::string log = fmt::format("{}/cycloidal--{}--s1.mcap", here, variant);
  std::vector<std::string> node = {"emulator", "--variant", variant,       "--port", std::to_string(port),
                                   "--report", report,      "--idle-exit", "1"};
  if (image) node.emplace_back("--image");
  node.insert(node.end(), c.node_arguments.begin(), c.node_arguments.end());
  const std::string address = fmt::format("127.0.0.1:{}", port);
  std::vector<std::string> run = {"run",        variant,    "--plant", "emulator", "--node", address,
                                  "--duration", c.duration, "--out",   here,       "--quiet"};
  run.insert(run.end(), c.run_arguments.begin(), c.run_arguments.end());
  Child emulator(program, node, here + "-node.txt");
  const auto listens = [&] {
    return read_whole_file(here + "-node.txt").value_or("").find(address) != std::string::npos;
  };
  wait_until(listens, longest_start_s);
  Child controller(program, run, here + "-run.txt", c.before_run);
  wait_until([&] { return std::filesystem::exists(log); }, longest_start_s);
  wait_s(strike_s);
  c.strike({controller, program, variant, address, here});
  out.exit_code = controller.wait(20.0);
  out.node_exit_code = emulator.wait(5.0);
  look_at_log(log, out);
  look_at_node(report, out);
  if (c.of_plant && out.log_ticks > 0) time_detection(read_run(log), node_begun_ns(report), out);
  return out;
}

}  // namespace

std::vector<ProcessOutcome> process_faults(const std::string& program, const std::string& folder,
                                           const std::string& variant, bool image) {
  std::vector<ProcessOutcome> table;
  int port = 20000 + ::getpid() % 20000;
  std::vector<Case> all = cases();
  if (image) std::ranges::move(plant_cases(), std::back_inserter(all));
  for (const Case& c : all) table.push_back(provoke(c, program, folder, variant, port++, image));
  return table;
}

}  // namespace solenoid
