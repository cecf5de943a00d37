#include "core/config/reader.hpp"
#include "experiments/campaign/files.hpp"
#include "experiments/campaign/interrupt.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/study/fishing.hpp"

#include <memory>

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

}  // namespace

void add_study(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<FishingCommand>();
  CLI::App* study = app.add_subcommand("study", "studies of solvers on problems with published answers");
  study->require_subcommand(1);
  CLI::App* command = study->add_subcommand("fishing", "Lotka-Volterra fishing: relaxed, rounded, two switches");
  command->add_option("--intervals", options->intervals, "grids, coarse to fine: divisors of 1536")
      ->delimiter(',')
      ->check(CLI::Range(1, fishing_model_steps));
  command->add_option("--format", options->format, "table, json or csv")
      ->check(CLI::IsMember({"table", "json", "csv"}));
  command->add_option("--svg", options->svg, "write the plot to this SVG file");
  command->callback([options, &exit_code] { exit_code = fishing(*options); });
}

}  // namespace solenoid
