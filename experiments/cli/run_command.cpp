#include "controllers/catalogue.hpp"
#include "controllers/factory.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/campaign/results_folder.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/live_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/report/live/live_server.hpp"
#include "experiments/rig/calibration.hpp"
#include "experiments/rig/plants.hpp"
#include "experiments/rig/preflight.hpp"
#include "experiments/rig/summary.hpp"

#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <functional>
#include <optional>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <unistd.h>

namespace solenoid {
namespace {

struct RunArguments {
  std::string variant, campaign, scenario, rig_file, policy = "at_once", out, format = "table";
  std::vector<std::string> faults;
  PlantChoice plant;
  SessionSettings session;
  std::uint64_t seed = 1;
  double duration_s = 0.0;
  int repeat = 1;
  bool no_realtime = false, quiet = false, live = false;
  int live_port = 0;
};

std::atomic<bool> rearm_signal{false};

/// A line `r` on standard input, or SIGUSR1.
bool rearm_wanted() {
  if (rearm_signal.exchange(false)) return true;
  pollfd in{STDIN_FILENO, POLLIN, 0};
  if (isatty(STDIN_FILENO) == 0 || poll(&in, 1, 0) != 1 || !(in.revents & POLLIN)) return false;
  char line[64];
  const ssize_t size = read(STDIN_FILENO, line, sizeof line);
  return size > 0 && line[0] == 'r';
}

/// One moving line on a terminal, else a line a second.
class StatusLine {
 public:
  void show(const TickRecord& tick, const SystemDescription& system) {
    const bool terminal = isatty(STDERR_FILENO) != 0;
    if (terminal)
      fmt::print(stderr, "\r\033[K{}", status_line(tick, system));
    else if (tick.sensors.time_s >= next_s_)
      fmt::print(stderr, "{}\n", status_line(tick, system)), next_s_ = tick.sensors.time_s + 1.0;
    std::fflush(stderr);
    open_ = terminal;
  }
  ~StatusLine() {
    if (open_) fmt::print(stderr, "\n");
  }

 private:
  double next_s_ = 0.0;
  bool open_ = false;
};

/// The chosen cell of the campaign, once for each repeat, with a seed of its own.
Campaign campaign_of(const RunArguments& options) {
  Campaign campaign = read_real_time_task(options.campaign, options.variant, options.scenario);
  campaign.seeds.clear();
  for (int i = 0; i < options.repeat; ++i) campaign.seeds.push_back(options.seed + static_cast<std::uint64_t>(i));
  campaign.runs = campaign.runs.over(campaign.scenarios, campaign.seeds);
  ScenarioConfig scenario = campaign.scenarios.front();
  if (options.duration_s > 0) scenario.duration_s = options.duration_s;
  campaign.scenarios = ScenarioList::only(std::move(scenario));
  return campaign;
}

/// Measurement must be plausible; a plant that stands elsewhere is brought to the task's start first.
void look_before_start(const RunArguments& options, Plant& plant, const VariantConfig& variant,
                       const ScenarioConfig& scenario, SessionSettings& session) {
  constexpr double near = 1e-3;
  const System& system = system_of(scenario);
  const Preflight found = preflight(plant, system.description(), session.ladder.plausibility, variant.timing.tick_s);
  if (!options.quiet || !found.good()) fmt::print(stderr, "{}\n", found.text(system.description()));
  if (!found.good()) throw std::runtime_error("the sensors are not plausible: not started");
  const AxisValues start = scenario.trajectory.start();
  for (std::size_t a = 0; a < system.description().axes.size(); ++a)
    session.at_start_position = session.at_start_position && std::abs(found.at[a] - start[a]) < near;
}

SessionResult run_one(const RunArguments& options, const Campaign& campaign, const CampaignRun& run,
                      const std::string& folder) {
  const ScenarioConfig& scenario = campaign.scenarios.front();
  const VariantConfig variant = told(campaign.variants.front(), scenario);
  const OpenedPlant opened = open_plant(options.plant, variant, scenario, run.seed);
  SessionSettings session = options.session;
  if (opened.rig) look_before_start(options, *opened.plant, variant, scenario, session);
  if (opened.rig) session.after_last_tick = [io = &opened.rig->io()] { io->safe(); };
  session.duration_s = scenario.duration_s;
  session.policy = options.policy == "next_slot" ? PlanPolicy::next_slot : PlanPolicy::at_once;
  session.faults = options.plant.faults;
  session.log_folder = folder;
  session.log_name = run.id;
  session.about = {{"variant", variant.name},          {"scenario", scenario.name},
                   {"plant", options.plant.kind},      {"policy", options.policy},
                   {"seed", std::to_string(run.seed)}, {"campaign", campaign.resolved_toml},
                   {"rig", options.plant.rig.text},    {"lowering_s", fmt::format("{}", session.ladder.lowering_s)}};
  if (options.plant.kind == "emulator") session.about["node"] = node_address(options.plant);
  if (options.no_realtime) session.tick_priority = session.solver_priority = 0;
  StatusLine status;
  SessionWatch watch;
  watch.interrupted = InterruptGuard::raised;
  watch.rearm_wanted = rearm_wanted;
  if (!options.quiet)
    watch.show = [&](const TickRecord& tick) { status.show(tick, system_of(variant).description_for(variant)); };
  SessionResult result = run_session(*opened.plant, variant, scenario, session, watch);
  if (opened.rig) result.io = opened.rig->io().health();
  return result;
}

int run(const RunArguments& chosen) {
  RunArguments options = chosen;
  const Campaign campaign = campaign_of(options);
  options.plant.faults = parse_faults(options.faults, simulation_of(*campaign.system));
  const VariantConfig variant = told(campaign.variants.front(), campaign.scenarios.front());
  options.plant.rig = options.rig_file.empty() ? usual_rig(variant) : read_rig_file(options.rig_file, variant);
  expect_noise(options.plant, campaign.scenarios.front());
  const double lowering_s = options.session.ladder.lowering_s;
  options.session.ladder = options.plant.rig.ladder;
  options.session.rates = options.plant.rig.rates;
  if (lowering_s > 0) options.session.ladder.lowering_s = lowering_s;
  require_real_time(variant);
  const std::string folder = options.out.empty() ? "results/run-" + compact_timestamp() : options.out;
  const InterruptGuard guard;
  std::signal(SIGUSR1, [](int) { rearm_signal.store(true); });
  std::optional<LiveServer> server;
  if (options.live) {
    server.emplace(campaign, folder, options.live_port, LiveServer::Earlier::repeated);
    options.session.live_socket = server->tick_socket();
    fmt::print(stderr, "live page at {}\n", server->url());
  }
  ResultsFolder results(folder, campaign, {.jobs = 1, .logged = true});
  std::vector<RunRecord> records;
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  std::string text;
  bool clean = true, stopped = false;
  const auto keep = [&](const std::function<void()>& write) {  // a disk that fails hides nothing of how a run ended
    try {
      write();
    } catch (const OutputError& error) {
      fmt::print(stderr, "solenoid: {}\n", error.what());
      results.abandon(error.what());
      clean = false;
    }
  };
  for (const CampaignRun& cell : campaign.runs) {
    SessionResult result;
    try {
      result = run_one(options, campaign, cell, folder);
    } catch (const std::exception& error) {
      results.abandon(error.what());
      throw;
    }
    if (records.empty() && !options.quiet) fmt::print(stderr, "{}", setup_text(result.setup));
    RunRecord record = record_of(campaign, cell, result.metrics);
    if (!result.clean())
      record.status =
          "failed: " + (result.log_problem.empty() ? "SAFE: " + to_string(result.causes, campaign.system->description())
                                                   : result.log_problem);
    text += session_text(record, result);
    list.push_back(session_json(record, result));
    clean = clean && result.clean();
    keep([&] { results.add(encode_run({cell.hash, record, campaign.scenarios.front().duration_s, {}})); });
    records.push_back(record);
    stopped = result.interrupted;
    if (stopped || !clean) break;
  }
  keep([&] { results.close(stopped ? "interrupted" : clean ? "finished" : "failed"); });
  if (records.size() > 1) text += repeats_text(records);
  write_standard_output(options.format == "json" ? nlohmann::ordered_json{{"runs", list}}.dump(1) + "\n"
                                                 : text + fmt::format("Results: {}\n", folder));
  if (server && !stopped) server->stay();
  return !clean ? failure : stopped ? interrupted : success;
}

void add_plant_options(CLI::App& command, RunArguments& o) {
  command
      .add_option("--plant", o.plant.kind,
                  "sim (the scenario's plant in this process), emulator (UDP I/O node) or comedi; default sim")
      ->check(CLI::IsMember({"sim", "emulator", "comedi"}));
  command.add_option("--rig", o.rig_file, "TOML of calibration, wiring and limits (docs/reference/rig.md)")
      ->type_name(value_kind::toml);
  command.add_option("--node", o.plant.address,
                     "ADDRESS:PORT of the UDP I/O node; default the rig file's, or 127.0.0.1:47811");
  command.add_option("--key", o.plant.key_file, "file of the key that the node has too (docs/reference/rig.md)")
      ->type_name(value_kind::file);
  command.add_option("--fault", o.faults,
                     "provoke a fault, repeatable: " + fault_help(simulation_of(*systems().front())));
}

void add_realtime_options(CLI::App& command, RunArguments& o) {
  command.add_option("--policy", o.policy, "plans take effect at_once (default) or in the next_slot")
      ->check(CLI::IsMember({"at_once", "next_slot"}));
  command.add_flag("--no-realtime", o.no_realtime, "do not ask for SCHED_FIFO");
  command.add_option("--tick-core", o.session.tick_core, "core of the tick's thread; default: any")
      ->check(CLI::Range(0, 1023));
  command.add_option("--solver-core", o.session.solver_core, "core of the solver; default: any")
      ->check(CLI::Range(0, 1023));
  command
      .add_option("--rearm-wait", o.session.rearm_wait_s,
                  "seconds to wait in SAFE for a re-arm (r and Enter, or SIGUSR1); default 0: the run ends")
      ->check(CLI::Range(0.0, 3600.0));
  command
      .add_option("--lowering", o.session.ladder.lowering_s,
                  "seconds of braking by continuous inputs (the actuator's motor) in SAFE; default 0")
      ->check(CLI::Range(0.0, 5.0));
  command.add_option("--udp", o.session.udp_ports, "send every tenth tick as JSON to this UDP port of 127.0.0.1")
      ->expected(1)
      ->check(CLI::Range(1, 65535));
}

}  // namespace

void add_run(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<RunArguments>();
  CLI::App* command = app.add_subcommand("run", "a variant in real time, on the twin, the emulator or the rig");
  command->add_option("variant", options->variant, "a variant of the campaign or a shipped one")
      ->type_name(value_kind::variant)
      ->required();
  command
      ->add_option("--campaign", options->campaign,
                   "where the task is from: a file, or a shipped one; default: of the variant's system, "
                   "of the actuator rig")
      ->type_name(value_kind::campaign);
  command->add_option("--scenario", options->scenario, "the task; default the campaign's first")
      ->type_name(value_kind::scenario);
  command->add_option("--duration", options->duration_s, "seconds; default: the task's")
      ->check(CLI::Range(0.01, 86400.0));
  command->add_option("--seed", options->seed, "of a simulated plant's noise; default 1");
  command->add_option("--repeat", options->repeat, "so many runs, seeds counting up; mean and spread at the end")
      ->check(CLI::Range(1, 1000));
  command->add_option("--out", options->out, "results folder; default results/run-TIME")->type_name(value_kind::folder);
  command->add_option("--format", options->format, "table or json, on standard output; default table")
      ->check(CLI::IsMember({"table", "json"}));
  command->add_flag("--quiet", options->quiet, "no status line");
  add_live_options(*command, options->live, options->live_port);
  add_plant_options(*command, *options);
  add_realtime_options(*command, *options);
  command->footer(
      "Ctrl-C stops safely: the system's safe command (coils off, motor 0 N), then the log is closed. "
      "Exit codes: 0 ended as told, 1 ended in SAFE or without its log, 2 refused, 130 interrupted.");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace solenoid
