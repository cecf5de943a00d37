#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "core/config/whole_file.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/process_setup.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/rig/calibration.hpp"
#include "experiments/rig/plants.hpp"
#include "experiments/rig/session.hpp"
#include "experiments/systems/actuator/commission/commission_record.hpp"
#include "experiments/systems/actuator/commission/steps.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr int tick_priority = 80;

struct CommissionArguments {
  std::string variant = "nine_state", rig_file, plane = "horizontal", out, step, from;
  std::vector<std::string> faults;
  PlantChoice plant;
  OutputOptions output;
  bool list = false, yes = false;
};

std::string step_names() {
  std::vector<std::string> names;
  for (const StepInfo& s : commission_steps()) names.emplace_back(s.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

void require_step(const std::string& option, const std::string& name) {
  if (name.empty() || std::ranges::any_of(commission_steps(), [&](const StepInfo& s) { return name == s.name; }))
    return;
  throw ConfigError(fmt::format("{}: '{}' is no step (allowed: {})", option, name, step_names()));
}

/// A line of the terminal, if one has been typed; a terminal gives one line a read.
std::optional<std::string> typed_line() {
  pollfd in{STDIN_FILENO, POLLIN, 0};
  if (::poll(&in, 1, 0) != 1 || (in.revents & (POLLIN | POLLHUP)) == 0) return std::nullopt;
  std::array<char, 64> line;
  const ssize_t size = ::read(STDIN_FILENO, line.data(), line.size());
  if (size <= 0) return "q";  // the end of it: nobody is there
  std::string text(line.data(), static_cast<std::size_t>(size));
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
  return text;
}

/// What was typed before a question is no answer to it.
void ask(const std::string& what) {
  ::tcflush(STDIN_FILENO, TCIFLUSH);
  fmt::print(stderr, "        {}\n", what);
}

/// The scenario whose plane the rig stands in: its plant, where that is simulated, and its first motion.
Campaign task_of(const CommissionArguments& options) {
  const bool horizontal = options.plane == "horizontal";
  return read_real_time_task(horizontal ? "identify" : "rig", options.variant, horizontal ? "bench" : "cycloidal");
}

/// The first motion, in real time under the fallback ladder, logged in the results folder.
MotionOutcome first_motion(Plant& plant, RigPlant& rig, const CommissionArguments& options, const Campaign& task,
                           const RigFile& file, const std::string& folder) {
  const ScenarioConfig& scenario = task.scenarios.front();
  const VariantConfig variant = told(task.variants.front(), scenario);
  SessionSettings session;
  session.ladder = file.ladder;
  session.rates = file.rates;
  session.duration_s = scenario.duration_s;
  session.at_start_position = false;
  session.after_last_tick = [&rig] { rig.io().safe(); };
  session.log_folder = folder;
  session.log_name = "motion";
  session.about = {{"variant", variant.name}, {"scenario", scenario.name}, {"plant", options.plant.kind}};
  SessionWatch watch;
  watch.interrupted = InterruptGuard::raised;
  // The step before ended with safe outputs: the node's own timeout after them is not this run's.
  constexpr double node_is_safe_s = 0.05;
  MonotonicClock().sleep_until(node_is_safe_s);
  plant.read(0.0);
  const SessionResult result = run_session(plant, variant, scenario, session, watch);
  MotionOutcome outcome;
  outcome.clean = result.clean() && !result.interrupted;
  outcome.rmse_mm = result.metrics["rmse_mm"];
  outcome.largest_mm = result.metrics["mae_mm"];
  outcome.told = result.log_problem.empty() ? to_string(result.causes, actuator_description()) : result.log_problem;
  return outcome;
}

/// What was found in an earlier walk, of which only what is before --from or beside --step is kept.
CommissionRecord begun_record(const CommissionArguments& options, const std::string& path) {
  CommissionRecord record{options.variant, options.plant.kind, options.plane, {}};
  if (!std::filesystem::exists(path)) return record;
  if (options.from.empty() && options.step.empty())
    throw ConfigError(
        fmt::format("{}: is there already (allowed: --from STEP goes on, --step STEP repeats one, "
                    "another --out begins anew)",
                    path));
  CommissionRecord before = CommissionRecord::parse(read_whole_file(path).value_or(""), path);
  if (before.variant != record.variant || before.plane != record.plane || before.plant != record.plant)
    throw ConfigError(
        fmt::format("{}: is of variant '{}' in the {} plane on plant {} (allowed: the same, or another --out)", path,
                    before.variant, before.plane, before.plant));
  if (!options.from.empty()) before.forget_from(options.from);
  return before;
}

/// Whether the operator wants this step, whose outputs move something.
bool wanted(CommissionState& state, const StepInfo& step) {
  const std::string name = step.name;
  const bool moves =
      name != "link" && name != "sensors" && name != "position" && name != "identify" && name != "motion";
  return !moves || !state.settings.beside.present ||
         asked_and_done(state, fmt::format("next, {}: {}", name, step.what));
}

/// Carries out the steps that were asked for; the record is written after each. False: interrupted.
bool walk(const CommissionArguments& options, CommissionState& state, CommissionRecord& record,
          const std::string& path) {
  const auto& steps = commission_steps();
  bool begun = options.from.empty() && options.step.empty();
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const std::string name = steps[i].name;
    begun = begun || name == options.from || name == options.step;
    if (!begun) continue;
    StepOutcome outcome;
    try {
      recall(state, record.steps);
      fmt::print(stderr, "[{}/{}] {}: {}\n", i + 1, steps.size(), name, steps[i].what);
      if (wanted(state, steps[i])) {
        outcome = carry_out(name, state, record.steps);
      } else {
        outcome.name = name;
        outcome.verdict = StepVerdict::skipped;
        outcome.note = "left out by the operator";
      }
    } catch (const BenchInterrupted&) {
      state.bench.safe();
      return false;
    }
    if (InterruptGuard::raised()) return false;  // during the motion, whose outcome says nothing then
    for (const Measured& m : outcome.measured)
      if (m.low || m.high) fmt::print(stderr, "        {}{}\n", text_of(m), m.good() ? "" : "  <--");
    fmt::print(stderr, "        {}{}{}\n", to_string(outcome.verdict), outcome.note.empty() ? "" : ": ", outcome.note);
    for (const std::string& finding : outcome.findings) fmt::print(stderr, "        FOUND {}\n", finding);
    const bool stopped = outcome.verdict == StepVerdict::stopped;
    record.add(std::move(outcome));
    write_file_atomically(path, record.json());
    if (stopped || !options.step.empty()) break;
  }
  return true;
}

int commission(const CommissionArguments& chosen) {
  CommissionArguments options = chosen;
  if (options.list) {
    options.output.write(steps_result());
    return success;
  }
  require_step("--step", options.step);
  require_step("--from", options.from);
  if (!options.step.empty() && !options.from.empty())
    throw ConfigError("--step and --from: one step, or from one on (allowed: one of the two)");
  const bool simulated = options.plant.kind == "sim";
  if (!options.faults.empty() && !simulated)
    throw ConfigError(
        "--fault: only with --plant sim; the emulator takes its own (allowed: solenoid emulator --fault)");
  if (const System& system = system_of(shipped_variant(options.variant)); system.name() != "actuator")
    throw ConfigError(
        fmt::format("--variant {}: there are steps for the actuator alone, not for '{}' (allowed: a "
                    "variant of the actuator; `solenoid check --plant {} --variant {}` looks at this one's "
                    "link and sensors)",
                    options.variant, system.name(), options.plant.kind, options.variant));
  if (!simulated && !options.yes && isatty(STDIN_FILENO) == 0)
    throw ConfigError(
        "--plant " + options.plant.kind +
        ": there is no terminal to ask at before something moves (allowed: a terminal, or --yes, which asks nothing)");
  const Campaign task = task_of(options);
  const VariantConfig variant = told(task.variants.front(), task.scenarios.front());
  options.plant.rig = options.rig_file.empty() ? usual_rig(variant) : read_rig_file(options.rig_file, variant);
  options.plant.faults = parse_faults(options.faults, simulation_of(*task.system));
  const std::string folder = options.out.empty() ? "results/commission-" + compact_timestamp() : options.out;
  const std::string path = folder + "/commission.json";
  CommissionRecord record = begun_record(options, path);

  CommissionSettings settings;
  settings.variant = &variant;
  const LadderSettings& ladder = options.plant.rig.ladder;
  settings.plausibility = ladder.plausibility;
  if (!ladder.limits.empty()) {
    settings.position_low_m = ladder.limits[position_channel].low;
    settings.position_high_m = ladder.limits[position_channel].high;
  }
  settings.plane = options.plane == "horizontal" ? Plane::horizontal : Plane::vertical;
  settings.now = timestamp;
  settings.interrupted = InterruptGuard::raised;
  settings.identify_command =
      fmt::format("./solenoid identify --plant {} --valves {}", options.plant.kind, variant.modes);
  settings.beside.present = !options.yes && !simulated && isatty(STDIN_FILENO) != 0;
  settings.beside.ask = ask;
  settings.beside.answer = typed_line;

  const InterruptGuard guard;
  const OpenedPlant opened = open_plant(options.plant, variant, task.scenarios.front(), 1);
  create_folder(folder);
  std::unique_ptr<BenchClock> clock;
  if (simulated) {
    clock = std::make_unique<BenchClockOf<FakeClock>>();
  } else {
    lock_memory();
    prepare_thread("tick");
    InterruptGuard::hear();  // the one thread is a real-time one
    set_fifo_priority("tick", tick_priority);
    clock = std::make_unique<BenchClockOf<MonotonicClock>>();
    settings.motion = [&](Plant& plant) {
      return first_motion(plant, *opened.rig, options, task, options.plant.rig, folder);
    };
  }
  Bench bench(*opened.plant, *clock, system_of(variant).modes(variant), actuator(variant).nominal.motor_force_limit_n(),
              variant.timing.tick_s, settings.interrupted);
  CommissionState state = new_commission(bench, settings);
  const bool done = walk(options, state, record, path);
  if (opened.rig) opened.rig->io().safe();
  write_file_atomically(path, record.json());
  Result result = result_of(record);
  result.notes.push_back(fmt::format("Record: {}", path));
  if (!done) result.notes.push_back("interrupted: outputs safe; --from STEP with the same --out goes on");
  options.output.write(result);
  return !done ? interrupted : record.all_good() ? success : failure;
}

}  // namespace

void add_commission(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CommissionArguments>();
  CommissionArguments& o = *options;
  CLI::App* command = app.add_subcommand(
      "commission", "the actuator's rig step by step: each sensor, each coil, leaks, delays, end stops, first motion");
  command
      ->add_option("--plant", o.plant.kind,
                   "sim (a rehearsal on the twin, faster than time; default), emulator (UDP I/O node) or comedi")
      ->check(CLI::IsMember({"sim", "emulator", "comedi"}));
  command->add_option("--variant", o.variant, "a shipped variant: whose valves the rig has; default nine_state")
      ->type_name(value_kind::variant);
  command
      ->add_option("--plane", o.plane,
                   "of the arm: horizontal (default: laid flat, the motor reaches both end stops) or vertical")
      ->check(CLI::IsMember({"horizontal", "vertical"}));
  command->add_option("--node", o.plant.address,
                      "ADDRESS:PORT of the UDP I/O node; default the rig file's, or 127.0.0.1:47811");
  command->add_option("--key", o.plant.key_file, "file of the key that the node has too (docs/reference/rig.md)")
      ->type_name(value_kind::file);
  command->add_option("--rig", o.rig_file, "TOML of calibration, wiring and limits (docs/reference/rig.md)")
      ->type_name(value_kind::toml);
  command->add_option("--step", o.step, "this step alone: " + step_names());
  command->add_option("--from", o.from, "from this step on; what was found before it stays");
  command->add_option("--fault", o.faults, "sim: a fault by script, repeatable (docs/reference/rig.md)")
      ->allow_extra_args(false);
  command->add_option("--out", o.out, "folder of the record; default results/commission-TIME")
      ->type_name(value_kind::folder);
  command->add_flag("--list", o.list, "list the steps and what they ask, do nothing");
  command->add_flag("--yes", o.yes, "ask nothing: what needs a hand is left out");
  add_output_options(*command, o.output, {"table", "json"});
  command->callback([options, &exit_code] { exit_code = commission(*options); });
}

}  // namespace solenoid
