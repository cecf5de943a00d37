#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/study/scaling_output.hpp"

#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

namespace solenoid {
namespace {

struct ScalingCommand {
  ScalingOptions study;
  std::string format = "table", svg, png;
};

/// One line that moves on a terminal; otherwise a line for each row.
void show_progress(const std::string& what) {
  if (isatty(STDERR_FILENO) != 0)
    fmt::print(stderr, "\rscaling: {:<40}", what);
  else
    fmt::print(stderr, "scaling: {}\n", what);
  std::fflush(stderr);
}

int scaling(const ScalingCommand& command) {
  const InterruptGuard guard;
  const auto rows = study_scaling(command.study, show_progress, InterruptGuard::raised);
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\n");
  write_standard_output(command.format == "json"  ? scaling_json(command.study, rows)
                        : command.format == "csv" ? scaling_csv(rows)
                                                  : scaling_text(command.study, rows));
  if (InterruptGuard::raised()) {
    fmt::print(stderr, "solenoid: interrupted after {} rows\n", rows.size());
    return interrupted;
  }
  if (!command.svg.empty()) draw_scaling(command.study, rows, command.svg, ScalingFigureFormat::svg);
  if (!command.png.empty()) draw_scaling(command.study, rows, command.png, ScalingFigureFormat::png);
  return success;
}

}  // namespace

void add_scaling(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ScalingCommand>();
  CLI::App* command = app.add_subcommand("scaling", "the search's nodes and time against blocks and valve states");
  command->add_option("--format", options->format, "table, json or csv")
      ->check(CLI::IsMember({"table", "json", "csv"}));
  command->add_option("--instances", options->study.instances, "recorded states a valve set")
      ->check(CLI::Range(1, 3000));
  command->add_flag("--cylinder", options->study.cylinder, "the cylinder alone, without the motor in the prediction");
  command->add_option("--svg", options->svg, "write the plot to this SVG file");
  command->add_option("--png", options->png, "write the plot to this PNG file");
  command->callback([options, &exit_code] { exit_code = scaling(*options); });
}

}  // namespace solenoid
