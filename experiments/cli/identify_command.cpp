#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "core/rt/process_setup.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/rig/calibration.hpp"
#include "experiments/rig/plants.hpp"
#include "experiments/rig/preflight.hpp"
#include "experiments/systems/actuator/identify/coverage_study.hpp"
#include "experiments/systems/actuator/identify/identify.hpp"
#include "experiments/systems/actuator/identify/log_source.hpp"
#include "experiments/systems/actuator/identify/output.hpp"
#include "experiments/systems/actuator/identify/run_experiment.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "experiments/systems/actuator/twin/twin_plant.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <iterator>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

namespace solenoid {
namespace {

struct IdentifyArguments {
  std::string experiments, twin_file, rig_file, base = "consistent", out, plane = "vertical", delimiter, decimal;
  OutputOptions output;
  std::vector<std::string> only, logs, mismatch;
  PlantChoice plant;
  ExperimentSettings run;
  LogSettings log;
  bool records = false, no_figures = false, thesis = false;
};

/// "friction=1.5": a factor on the simulated plant.
Mismatch parse_mismatch(const std::vector<std::string>& texts) {
  std::string toml;
  for (std::string text : texts) {
    if (const auto at = text.find('='); at != std::string::npos) text.replace(at, 1, " = ");
    toml += text + "\n";
  }
  TableReader table = TableReader::from_text(toml, "--mismatch");
  return read_mismatch(table);
}

TwinParameters twin_of(const IdentifyArguments& options) {
  const TwinParameters twin = options.twin_file == "study" ? coverage_twin()
                              : options.twin_file.empty()  ? nominal_twin()
                                                           : read_twin_file(options.twin_file);
  TwinCase task;
  task.mismatch = parse_mismatch(options.mismatch);
  return twin_for(twin, task);
}

std::vector<Experiment> chosen_experiments(const IdentifyArguments& options) {
  std::vector<Experiment> all =
      options.experiments.empty() ? shipped_experiments() : read_experiments_file(options.experiments);
  if (options.only.empty()) return all;
  std::vector<std::string> names;
  names.reserve(all.size());
  for (const Experiment& e : all) names.push_back(e.name);
  for (const std::string& name : options.only)
    if (std::ranges::find(names, name) == names.end())
      throw ConfigError(fmt::format("--only: '{}' is not known (allowed: {})", name, fmt::join(names, ", ")));
  std::erase_if(all,
                [&](const Experiment& e) { return std::ranges::find(options.only, e.name) == options.only.end(); });
  return all;
}

/// Whether the operator has done what the experiment needs; asked only at a terminal.
bool prepared(const Experiment& experiment, std::vector<std::string>& remarks) {
  if (experiment.prepare.empty()) return true;
  if (isatty(STDIN_FILENO) == 0) {
    remarks.push_back(
        fmt::format("experiment '{}' left out: nobody at a terminal to {}", experiment.name, experiment.prepare));
    return false;
  }
  fmt::print(stderr, "{}: {}, then Enter (s and Enter: leave it out) ", experiment.name, experiment.prepare);
  std::string line;
  return std::getline(std::cin, line) && line != "s";
}

/// The motor carries the slide to where the experiment begins; upright it hangs there by itself.
Experiment approach_to(const Experiment& experiment) {
  Experiment approach;
  approach.name = "approach";
  ExperimentStep go, stay;
  go.to_m = experiment.start_m;
  go.speed_m_s = 0.03;
  go.seconds = 5.0;
  stay.seconds = 0.3;
  approach.steps = {go, stay};
  return approach;
}

std::vector<Record> real_time_records(const IdentifyArguments& options, std::vector<std::string>& remarks) {
  PlantChoice choice = options.plant;
  VariantConfig believed = new_variant();
  believed.modes = options.run.valves;
  actuator(believed).nominal = named_parameters(options.base);
  choice.rig = options.rig_file.empty() ? usual_rig(believed) : read_rig_file(options.rig_file, believed);
  lock_memory();
  const OpenedPlant opened = open_plant(choice, believed, {}, options.run.seed);
  const Preflight found =
      preflight(*opened.plant, actuator_description(), choice.rig.ladder.plausibility, actuator_timing.tick_s);
  fmt::print(stderr, "{}\n", found.text(actuator_description()));
  if (!found.good()) throw std::runtime_error("the sensors are not plausible: not started");
  std::vector<Record> records;
  for (const Experiment& e : chosen_experiments(options)) {
    if (InterruptGuard::raised() || !prepared(e, remarks)) continue;
    fmt::print(stderr, "{}: {}, {:.0f} s at most\n", e.name, e.about, e.longest_s());
    if (e.plane == Plane::horizontal)
      run_experiment_in_real_time(approach_to(e), *opened.plant, options.run, InterruptGuard::raised);
    if (!InterruptGuard::raised())
      records.push_back(run_experiment_in_real_time(e, *opened.plant, options.run, InterruptGuard::raised));
  }
  opened.rig->io().safe();
  return records;
}

std::vector<Record> simulated_records(const IdentifyArguments& options, const TwinParameters& twin) {
  std::vector<Record> records;
  for (const Experiment& e : chosen_experiments(options)) {
    if (InterruptGuard::raised()) break;
    records.push_back(simulate_experiment(e, twin, options.run));
    fmt::print(stderr, "{}: {} ({:.0f} s)\n", e.name, e.about, records.back().duration_s());
  }
  return records;
}

/// How a log was read, where that is not plain, is told on standard error before anything is found in it.
std::vector<Record> logged_records(const IdentifyArguments& options) {
  LogSettings settings = options.log;
  if (!options.delimiter.empty()) settings.dialect.delimiter = delimiter_of(options.delimiter);
  if (!options.decimal.empty()) settings.dialect.decimal = decimal_of(options.decimal);
  std::vector<Record> records;
  for (const std::string& path : options.logs) {
    LogRecords log = read_log_records(path, settings);
    if (!log.told.empty()) fmt::print(stderr, "solenoid: {}: {}\n", path, fmt::join(log.told, "; "));
    records.insert(records.end(), std::make_move_iterator(log.records.begin()),
                   std::make_move_iterator(log.records.end()));
  }
  return records;
}

/// All that a reader may want later, in one folder.
void write_results(const IdentifyArguments& options, const std::string& folder, const std::string& source,
                   const std::vector<Record>& records, const Findings& found, const Result& result) {
  create_folder(folder);
  if (options.records || options.plant.kind != "sim") {
    create_folder(folder + "/records");
    for (const Record& r : records) write_file_atomically(folder + "/records/" + r.part_name() + ".csv", record_csv(r));
  }
  write_file_atomically(folder + "/parameters.toml", parameter_file(found, options.base, source));
  write_file_atomically(folder + "/estimates.csv", result.csv());
  write_file_atomically(folder + "/estimates.json", result.json());
  if (options.no_figures) return;
  create_folder(folder + "/figures");
  try {
    for (const ResidualPlot& plot : found.plots) draw(residuals(plot), folder + "/figures/" + plot.name + ".svg");
  } catch (const ConfigError& error) {
    fmt::print(stderr, "solenoid: no figures: {}\n", error.what());
  }
}

int run_identification(IdentifyArguments& options) {
  if (options.thesis) {
    write_standard_output(thesis_friction_text());
    return success;
  }
  options.log.plane = options.plane == "vertical" ? Plane::vertical : Plane::horizontal;
  options.log.valves = options.run.valves;
  ActuatorParameters given;
  try {
    given = named_parameters(options.base);
  } catch (const std::invalid_argument& error) {
    throw ConfigError(fmt::format("--base: {}", error.what()));
  }
  const InterruptGuard guard;
  std::vector<std::string> remarks;
  std::vector<Record> records;
  std::vector<KnownTruth> truths;
  std::string source = options.plant.kind;
  if (!options.logs.empty()) {
    records = logged_records(options);
    source = fmt::format("{}", fmt::join(options.logs, ", "));
  } else if (options.plant.kind == "sim") {
    const TwinParameters twin = twin_of(options);
    for (const auto& [name, value] : true_values(twin, options.run.loaded_payload_kg)) truths.push_back({name, value});
    records = simulated_records(options, twin);
    source = fmt::format("the twin, seed {}", options.run.seed);
  } else {
    records = real_time_records(options, remarks);
  }
  Findings found = identify(records, given);
  for (const Record& r : records)
    if (r.filled > 0)
      remarks.push_back(fmt::format("{}: {} of {} samples were late or missing", r.part_name(), r.filled, r.size()));
  found.remarks.insert(found.remarks.end(), remarks.begin(), remarks.end());
  const std::string folder = options.out.empty() ? "results/identify-" + compact_timestamp() : options.out;
  Result result = result_of(found, truths);
  write_results(options, folder, source, records, found, result);
  if (found.estimates.empty()) {
    for (const std::string& remark : found.remarks) fmt::print(stderr, "{}\n", remark);
    fmt::print(
        stderr,
        "solenoid: nothing can be estimated from {}: valves need records of 0.7 s and more in which they switch, "
        "mass and friction a slide that moves\nRecords: {}\n",
        source, folder);
    return InterruptGuard::raised() ? interrupted : failure;
  }
  result.notes = {
      fmt::format("Results: {0}; every variant with them: solenoid compare --model {0}/parameters.toml", folder)};
  options.output.write(result);
  return InterruptGuard::raised() ? interrupted : success;
}

void add_source_options(CLI::App& command, IdentifyArguments& o) {
  command
      .add_option("--plant", o.plant.kind,
                  "sim (the twin, faster than time; default), emulator (UDP I/O node) or comedi")
      ->check(CLI::IsMember({"sim", "emulator", "comedi"}));
  command
      .add_option("--twin", o.twin_file,
                  "sim: TOML of the twin (docs/reference/twin.md), or study; default: the nominal one")
      ->type_name(value_kind::toml);
  command.add_option("--mismatch", o.mismatch, "sim: factors on it: friction=1.5,flow=0.8,supply=,delay=,inertia=")
      ->delimiter(',');
  command.add_option("--seed", o.run.seed, "of the random sequences and a simulated plant's noise; default 1");
  command.add_option("--payload", o.run.loaded_payload_kg, "mounted where an experiment is loaded [kg]; default 0.15")
      ->check(CLI::Range(0.0, 10.0));
  command.add_option("--valves", o.run.valves, "two_way (default) or three_way")
      ->check(CLI::IsMember({"two_way", "three_way"}));
  command.add_option("--rig", o.rig_file, "TOML of calibration, wiring and limits (docs/reference/rig.md)")
      ->type_name(value_kind::toml);
  command.add_option("--node", o.plant.address, "ADDRESS:PORT of the UDP I/O node; default 127.0.0.1:47811");
  command.add_option("--log", o.logs, "no experiment: an MCAP log of run, or a CSV; repeatable")
      ->type_name(value_kind::file)
      ->allow_extra_args(false);
  command
      .add_option("--column", o.log.columns,
                  "of a CSV: NAME=COLUMN or NAME=COLUMN*FACTOR+OFFSET, of another MCAP NAME=TOPIC.FIELD..., "
                  "repeatable; NAME: time_s, position_m, "
                  "pressure_a_pa, pressure_b_pa, motor_n, coils, label")
      ->allow_extra_args(false);
  command
      .add_option("--delimiter", o.delimiter,
                  "between the cells of a CSV: comma, semicolon, tab, bar; default: found out")
      ->check(CLI::IsMember({"comma", "semicolon", "tab", "bar", ",", ";", "|"}));
  command.add_option("--decimal", o.decimal, "of a CSV's numbers: point or comma; default: found out")
      ->check(CLI::IsMember({"point", "comma", ".", ","}));
  command.add_option("--skip-lines", o.log.dialect.skip_lines, "lines before a CSV's heading; default: found out")
      ->check(CLI::Range(0, 10000));
  command.add_option("--plane", o.plane, "of a log: vertical (default) or horizontal")
      ->check(CLI::IsMember({"vertical", "horizontal"}));
}

}  // namespace

void add_identify(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<IdentifyArguments>();
  IdentifyArguments& o = *options;
  CLI::App* command =
      app.add_subcommand("identify", "the actuator's parameters from experiments or logs, with intervals");
  add_source_options(*command, o);
  command->add_option("--experiments", o.experiments, "TOML of other experiments (docs/how-to/identification.md)")
      ->type_name(value_kind::toml);
  command->add_option("--only", o.only, "only these experiments")->delimiter(',');
  command->add_option("--base", o.base, "parameter set that is corrected; default consistent")
      ->type_name(value_kind::parameter_set);
  command->add_option("--out", o.out, "results folder; default results/identify-TIME")->type_name(value_kind::folder);
  add_output_options(*command, o.output);
  command->add_flag("--records", o.records, "keep a simulated plant's records too, as CSV");
  command->add_flag("--no-figures", o.no_figures, "no residual plots");
  command->add_flag("--thesis", o.thesis, "no experiment: the thesis's tables 4-1 and 4-2 by these estimators");
  add_identify_residual(*command, exit_code);
  command->callback([options, command, &exit_code] {
    if (command->get_subcommands().empty()) exit_code = run_identification(*options);
  });
}

}  // namespace solenoid
