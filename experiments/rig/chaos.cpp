#include "experiments/rig/chaos.hpp"

#include "core/rt/clock.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/busy_threads.hpp"
#include "experiments/base/child_process.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/small_disk.hpp"
#include "experiments/campaign/same_results.hpp"
#include "experiments/rig/log/recorded_run.hpp"

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <unistd.h>

namespace solenoid {
namespace {

namespace fs = std::filesystem;

constexpr double longest_campaign_s = 120.0, longest_run_s = 60.0;
constexpr double run_s = 3.0;

/// None of its solvers looks at the clock: what they find is the same under any load.
constexpr const char* campaign_text = R"(variants = ["thesis_cylinder", "thesis_pd", "nine_pd"]
seeds = [1, 2, 3, 4, 5, 6, 7, 8]
[[scenario]]
name = "step"
trajectory = { kind = "step", height_m = 0.03, at_s = 0.1, hold_s = 1.5, steady_s = 0.5 }
noise = true
[[scenario]]
name = "loaded"
trajectory = { kind = "sine", lead_s = 0.5, periods = 1.5 }
payload_kg = 0.15
noise = true
)";

/// What an emulated node may suffer.
const std::vector<std::string> node_faults = {
    "process:killed@1", "process:stopped=0.1@1",  "packets:lost=1@1",       "packets:lost=0.05@1",
    "packets:late=2@1", "packets:repeated=0.1@1", "packets:corrupt=0.05@1", "process:crashed@1.5"};

constexpr double latest_safe_ms = 100.0;  // 20 are promised; the rest is for a machine that stands still
constexpr double own_stop_ms = 100.0;     // of a node with the fault `process:stopped`

std::string last_words(const std::string& path) {
  constexpr std::size_t most = 300;
  const std::string said = read_whole_file(path).value_or("");
  return said.substr(said.size() - std::min(said.size(), most));
}

class Chaos {
 public:
  Chaos(const ChaosSettings& settings, const std::function<bool()>& interrupted,
        const std::function<void(const std::string&)>& tell)
      : settings_(settings),
        interrupted_(interrupted),
        tell_(tell),
        random_(settings.seed),
        disk_(settings.folder + "/disk") {
    if (!disk_.own())
      outcome_.left_out.push_back("a full disk: no file system of its own can be mounted here: " + disk_.why());
  }

  ChaosOutcome run() {
    undisturbed_campaign();
    for (int round = 0; going_on(); ++round) {
      disturbed_campaign();
      if (going_on()) disturbed_run(round);
      tell_(fmt::format("{:.0f} of {:.0f} s: {} strikes, {} results and {} logs compared, {} findings", clock_.now_s(),
                        settings_.duration_s, strikes(), outcome_.results, outcome_.logs, outcome_.findings.size()));
    }
    return outcome_;
  }

 private:
  /// What a process may end with after what was done to it.
  struct Allowed {
    std::set<int> codes = {0};
    std::string done;
    void add(const std::string& what, std::initializer_list<int> more) {
      codes.insert(more);
      done += (done.empty() ? "" : ", ") + what;
    }
    bool has(const std::string& what) const { return done.find(what) != std::string::npos; }
  };
  using Strike = void (Chaos::*)(Child&, Allowed&);

  bool going_on() const { return clock_.now_s() < settings_.duration_s && !interrupted_(); }
  std::int64_t strikes() const {
    std::int64_t sum = 0;
    for (const auto& [what, times] : outcome_.strikes) sum += times;
    return sum;
  }
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  template <class T>
  const T& one_of(const std::vector<T>& all) {
    return all[std::uniform_int_distribution<std::size_t>(0, all.size() - 1)(random_)];
  }
  std::string file(const std::string& name) const { return settings_.folder + "/" + name; }
  std::string on_disk(const std::string& name) const { return file("disk/" + name); }
  void count(Allowed& allowed, const std::string& what, std::initializer_list<int> codes) {
    ++outcome_.strikes[what];
    allowed.add(what, codes);
  }
  void find(const std::string& what) {
    outcome_.findings.push_back(fmt::format("{:.1f} s: {}", clock_.now_s(), what));
    tell_("FOUND " + outcome_.findings.back());
  }

  std::vector<std::string> compare_to(const std::string& out) const {
    return {"compare", file("chaos.toml"), "--out", out, "--jobs", "2", "--format", "json"};
  }
  void undisturbed_campaign() {
    write_file_atomically(file("chaos.toml"), campaign_text);
    Child child(settings_.program, compare_to(file("undisturbed")), file("undisturbed.txt"));
    const int code = child.wait(longest_campaign_s);
    if (code != 0)
      throw OutputError(fmt::format("the undisturbed campaign ended with {} ({})", code, file("undisturbed.txt")));
  }

  // What is done to a process.

  void end_by_signal(Child& child, Allowed& allowed) {
    const int signal = one_of(std::vector{SIGINT, SIGTERM, SIGHUP, SIGKILL, SIGQUIT, SIGALRM});
    child.send(signal);
    count(allowed, fmt::format("SIG{}", sigabbrev_np(signal)), {128 + signal, 130});  // before its guard, after it
  }
  void crash(Child& child, Allowed& allowed) {
    const int signal = one_of(std::vector{SIGSEGV, SIGABRT, SIGXCPU});
    child.send(signal);
    count(allowed, fmt::format("SIG{}", sigabbrev_np(signal)), {128 + signal});
  }
  void from_the_terminal(Child& child, Allowed& allowed) {
    child.send(SIGTSTP);
    wait_s(0.2);
    child.send(SIGCONT);  // it may not have been guarded yet
    count(allowed, "SIGTSTP", {1});
  }
  void stop_for_a_while(Child& child, Allowed& allowed) {
    child.send(SIGSTOP);
    wait_s(between(0.01, 0.5));
    child.send(SIGCONT);
    count(allowed, "stopped and continued", {1});
  }
  void kill_a_worker(Child& child, Allowed& allowed) {
    const auto workers = children_of(child.id());
    if (workers.empty()) return;
    ::kill(one_of(workers), SIGKILL);
    count(allowed, "worker killed", {1});
  }
  void stop_a_worker(Child& child, Allowed& allowed) {
    const auto workers = children_of(child.id());
    if (workers.empty()) return;
    const pid_t worker = one_of(workers);
    ::kill(worker, SIGSTOP);
    wait_s(between(0.01, 0.5));
    ::kill(worker, SIGCONT);
    count(allowed, "worker stopped and continued", {});
  }
  void steal_the_processor(Child&, Allowed& allowed) {
    const BusyThreads busy(4);
    wait_s(between(0.05, 0.8));
    count(allowed, "processor stolen", {1});
  }
  void fill_the_disk(Child&, Allowed& allowed) {
    if (!disk_.own()) return;
    disk_.fill();
    wait_s(between(0.05, 0.5));
    disk_.give_back();
    count(allowed, "disk full", {1, 2});
  }
  /// Not to the child, but to what it left: the next start must notice.
  void damage_a_result() {
    std::vector<fs::path> files;
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(on_disk("campaign/shards"), none)) files.push_back(entry.path());
    if (files.empty()) return;
    const fs::path path = one_of(files);
    std::string bytes = read_whole_file(path).value_or("");
    if (bytes.empty()) return;
    const std::size_t at = random_() % bytes.size();
    if (random_() % 2 == 0)
      bytes.resize(at);
    else
      bytes[at] = static_cast<char>(bytes[at] ^ static_cast<char>(1 + random_() % 127));
    std::ofstream(path, std::ios::binary) << bytes;
    ++outcome_.strikes["result damaged"];
    ++outcome_.redone;
  }

  /// Strikes at random moments until the child has ended; finds what it must not end with.
  int disturb(Child& child, const std::vector<Strike>& all, double longest_s, double pause_s, Allowed& allowed,
              const std::string& name, const std::string& output) {
    const double begin = clock_.now_s();
    while (child.runs() && clock_.now_s() - begin < longest_s) {
      wait_until([&] { return !child.runs(); }, between(0.02, pause_s));
      if (child.runs()) (this->*one_of(all))(child, allowed);
    }
    const int code = child.wait(1.0);
    ++outcome_.exits[name][code];
    if (allowed.codes.contains(code)) return code;
    find(code == -1 ? fmt::format("{} did not end after {}", name, allowed.done)
                    : fmt::format("{} ended with {} after: {}; its last words: {}", name, code, allowed.done,
                                  last_words(output)));
    return code;
  }

  /// Until each of its results is there, or for a quarter of the whole time, so that a slow machine comes to the runs in
  /// real time too; some results are damaged on the way.
  void disturbed_campaign() {
    const std::vector<Strike> all = {&Chaos::end_by_signal, &Chaos::end_by_signal, &Chaos::stop_for_a_while,
                                     &Chaos::kill_a_worker, &Chaos::stop_a_worker, &Chaos::steal_the_processor,
                                     &Chaos::fill_the_disk};
    bool whole = false;
    const double end_s = clock_.now_s() + 0.25 * settings_.duration_s;
    while (going_on() && clock_.now_s() < end_s && !whole) {
      Allowed allowed;
      const bool limited = random_() % 8 == 0;
      const rlim_t most = random_() % 300'000;
      if (limited) count(allowed, "file size limited", {1, 2});
      const std::string output = file("compare.txt");
      Child child(settings_.program, compare_to(on_disk("campaign")), output, [&] {
        const rlimit limit{most, most};
        if (limited) ::setrlimit(RLIMIT_FSIZE, &limit);
      });
      whole = disturb(child, all, longest_campaign_s, 0.6, allowed, "compare", output) == 0;
      compare_results(whole);
      if (!whole && random_() % 2 == 0) damage_a_result();
    }
    if (!whole) {  // its time is over: the rest in peace
      Child child(settings_.program, compare_to(on_disk("campaign")), file("compare.txt"));
      if (const int code = child.wait(longest_campaign_s); code != 0)
        find(fmt::format("the last compare ended with {}", code));
      compare_results(true);
    }
    ++outcome_.campaigns;
    fs::remove_all(on_disk("campaign"));
  }

  /// All that is there is equal to the undisturbed campaign's; if `whole`, all is there.
  void compare_results(bool whole) {
    const SameResults same = compare_results_folders(file("undisturbed"), on_disk("campaign"), whole);
    outcome_.results += same.records;
    outcome_.traces += same.traces;
    for (const std::string& difference : same.differences) find(difference);
  }

  /// A controller and its node; what happens to either.
  void disturbed_run(int round) {
    const std::vector<Strike> all = {&Chaos::end_by_signal,       &Chaos::crash,
                                     &Chaos::from_the_terminal,   &Chaos::stop_for_a_while,
                                     &Chaos::steal_the_processor, &Chaos::fill_the_disk};
    ++outcome_.runs;
    const int port = 20000 + static_cast<int>((::getpid() + round) % 20000);
    const std::string address = fmt::format("127.0.0.1:{}", port), out = on_disk(fmt::format("run-{}", round));
    const std::string report = file("node.json"), output = file("run.txt");
    fs::remove(report);
    std::vector<std::string> node = {"emulator",
                                     "--variant",
                                     settings_.variant,
                                     "--port",
                                     std::to_string(port),
                                     "--report",
                                     report,
                                     "--idle-exit",
                                     "1",
                                     "--seed",
                                     std::to_string(round + 1)};
    if (round % 2 == 1) node.insert(node.end(), {"--fault", one_of(node_faults)});
    Child emulator(settings_.program, node, file("node.txt"));
    wait_s(0.3);
    Allowed allowed;
    if (round % 2 == 1) count(allowed, "node: " + node.back().substr(0, node.back().find('@')), {1});
    Child run(settings_.program,
              {"run", settings_.variant, "--plant", "emulator", "--node", address, "--duration",
               fmt::format("{}", run_s), "--out", out, "--quiet"},
              output);
    allowed.codes.insert({1, 2});  // a machine that stands still by itself; a node that could not begin
    disturb(run, all, longest_run_s, 3.0, allowed, "run", output);
    look_at_log(out);
    look_at_node(emulator, report, allowed);
    fs::remove_all(out);
  }
  void look_at_log(const std::string& out) {
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(out, none)) {
      if (entry.path().extension() != ".mcap" || fs::file_size(entry.path(), none) < 10'000) continue;
      try {
        const RecordedRun log = read_run(entry.path());
        ++outcome_.logs;
        outcome_.ticks += std::ssize(log.ticks);
        for (std::size_t i = 1; i < log.ticks.size(); ++i)
          if (log.ticks[i].sensors.time_s <= log.ticks[i - 1].sensors.time_s) {
            find(fmt::format("{}: time does not increase at tick {}", entry.path().filename().string(), i));
            break;
          }
      } catch (const std::exception& error) {
        find(error.what());
      }
    }
  }
  /// A node ends by itself when it hears no more. Where nobody came to it, it waits to be told.
  void look_at_node(Child& node, const std::string& report, const Allowed& allowed) {
    int code = node.wait(5.0);
    const bool told = code == -1;
    if (told) node.send(SIGTERM), code = node.wait(5.0);
    if (code == 0) return look_at_report(report, told, allowed);
    if (code == -1) return find(fmt::format("the node had to be killed after: {}", allowed.done));
    if (allowed.has("process:killed") || allowed.has("process:crashed")) return;
    find(fmt::format("the node ended with {} after: {}; its last words: {}", code, allowed.done,
                     last_words(file("node.txt"))));
  }
  void look_at_report(const std::string& path, bool told_to_end, const Allowed& allowed) {
    const auto text = read_whole_file(path);
    if (!text) return find(fmt::format("the node left no report after: {}", allowed.done));
    ++outcome_.reports;
    const auto report = parse_json(*text, path);
    if (report.at("timeouts") > 0) look_at_delay(report.at("safe_after_ms"), allowed);
    if (told_to_end && report.at("sessions") > 0)
      find(fmt::format("the node did not end by itself after: {}", allowed.done));
    if (report.at("sessions") > 1) find(fmt::format("the node had {} sessions", report.at("sessions").dump()));
    if (report.at("refused") > 0) find(fmt::format("the node refused {} commands", report.at("refused").dump()));
    if (const auto last = report.find("final_outputs"); last != report.end())
      for (const auto& [name, value] : last->items())
        if (value != 0) find(fmt::format("the node ended with {} = {} after: {}", name, value.dump(), allowed.done));
  }

  void look_at_delay(double safe_ms, const Allowed& allowed) {
    const bool stopped = allowed.has("process:stopped");
    if (!stopped) outcome_.worst_safe_ms = std::max(outcome_.worst_safe_ms, safe_ms);
    const double latest_ms = latest_safe_ms + (stopped ? own_stop_ms : 0.0);
    if (safe_ms > latest_ms)
      find(
          fmt::format("outputs safe {:.1f} ms after the last command (promised: 20; allowed, as machines stand still: "
                      "{:.0f}) after: {}",
                      safe_ms, latest_ms, allowed.done));
  }

  ChaosSettings settings_;
  std::function<bool()> interrupted_;
  std::function<void(const std::string&)> tell_;
  std::mt19937_64 random_;
  SmallDisk disk_;
  MonotonicClock clock_;
  ChaosOutcome outcome_;
};

}  // namespace

ChaosOutcome chaos(const ChaosSettings& settings, const std::function<bool()>& interrupted,
                   const std::function<void(const std::string&)>& tell) {
  create_folder(settings.folder);
  return Chaos(settings, interrupted, tell).run();
}

}  // namespace solenoid
