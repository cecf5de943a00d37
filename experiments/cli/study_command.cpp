#include "core/config/reader.hpp"
#include "experiments/campaign/files.hpp"
#include "experiments/campaign/interrupt.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/identify/study.hpp"
#include "experiments/report/text_table.hpp"
#include "experiments/study/fishing.hpp"

#include <memory>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

struct FishingCommand {
  std::vector<int> intervals = {12, 24, 48, 96, 192, 384, 768, 1536};
  std::string format = "table", svg;
};

int fishing(const FishingCommand& command) {
  for (const int count : command.intervals)
    if (fishing_model_steps % count != 0)
      throw ConfigError(
          fmt::format("--intervals: {} does not divide {} (allowed: its divisors)", count, fishing_model_steps));
  const InterruptGuard guard;
  const FishingStudy study = study_fishing(
      command.intervals, [](const std::string& what) { fmt::print(stderr, "fishing: {}\n", what); },
      InterruptGuard::raised);
  write_standard_output(command.format == "json"  ? fishing_json(study)
                        : command.format == "csv" ? fishing_csv(study)
                                                  : fishing_text(study));
  if (InterruptGuard::raised()) return interrupted;
  if (!command.svg.empty()) draw_fishing(study, command.svg);
  return success;
}

struct CoverageCommand {
  CoverageSettings settings;
  std::string twin_file, format = "table", svg;
};

int coverage(CoverageCommand& command) {
  if (!command.twin_file.empty()) command.settings.twin = read_twin_file(command.twin_file);
  if (command.settings.jobs == 0)
    command.settings.jobs = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const InterruptGuard guard;
  const CoverageStudy study = study_coverage(
      command.settings,
      [&](int done) { fmt::print(stderr, "identification: {} of {} seeds\n", done, command.settings.seeds); },
      InterruptGuard::raised);
  write_standard_output(command.format == "json"  ? coverage_json(study)
                        : command.format == "csv" ? coverage_csv(study)
                                                  : coverage_text(study, colour_wanted()));
  if (study.interrupted) return interrupted;
  if (!command.svg.empty()) draw_coverage(study, command.svg);
  return study.failed > 0 ? failure : success;
}

void add_identification(CLI::App& study, int& exit_code) {
  auto options = std::make_shared<CoverageCommand>();
  CLI::App* command = study.add_subcommand(
      "identification", "identified values against the truth of a twin that has the model's equations, seed by seed");
  command->add_option("--seeds", options->settings.seeds, "so many, counting up from 1; default 100")
      ->check(CLI::Range(1, 100000));
  command->add_option("--twin", options->twin_file, "TOML of another twin (docs/twin.md); default: the study's own");
  options->settings.jobs = 0;
  command->add_option("--jobs", options->settings.jobs, "worker processes; default: one a core")
      ->check(CLI::Range(1, 1024));
  command->add_option("--format", options->format, "table, json or csv")
      ->check(CLI::IsMember({"table", "json", "csv"}));
  command->add_option("--svg", options->svg, "write the plot to this SVG file");
  command->callback([options, &exit_code] { exit_code = coverage(*options); });
}

}  // namespace

void add_study(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<FishingCommand>();
  CLI::App* study = app.add_subcommand("study", "studies against known answers: solvers, identification");
  study->require_subcommand(1);
  CLI::App* command = study->add_subcommand("fishing", "Lotka-Volterra fishing: relaxed, rounded, two switches");
  command->add_option("--intervals", options->intervals, "grids, coarse to fine: divisors of 1536")
      ->delimiter(',')
      ->check(CLI::Range(1, fishing_model_steps));
  command->add_option("--format", options->format, "table, json or csv")
      ->check(CLI::IsMember({"table", "json", "csv"}));
  command->add_option("--svg", options->svg, "write the plot to this SVG file");
  command->callback([options, &exit_code] { exit_code = fishing(*options); });
  add_identification(*study, exit_code);
}

}  // namespace solenoid
