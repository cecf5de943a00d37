#include "experiments/base/interrupt.hpp"
#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/study/scaling.hpp"

#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

namespace solenoid {
namespace {

struct ScalingCommand {
  ScalingOptions study;
  OutputOptions output;
};

/// One line that moves on a terminal; otherwise a line for each row.
void show_size(const std::string& what) {
  if (isatty(STDERR_FILENO) != 0)
    fmt::print(stderr, "\rscaling: {:<40}", what);
  else
    fmt::print(stderr, "scaling: {}\n", what);
  std::fflush(stderr);
}

int scaling(const ScalingCommand& command) {
  const InterruptGuard guard;
  const auto rows = study_scaling(command.study, show_size, InterruptGuard::raised);
  if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\n");
  command.output.write(result_of(command.study, rows), !InterruptGuard::raised());
  if (InterruptGuard::raised()) {
    fmt::print(stderr, "solenoid: interrupted after {} rows\n", rows.size());
    return interrupted;
  }
  return success;
}

}  // namespace

void add_scaling(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ScalingCommand>();
  CLI::App* command = app.add_subcommand("scaling", "the search's nodes and time against blocks and valve states");
  add_output_options(*command, options->output);
  command->add_option("--instances", options->study.instances, "recorded states a valve set; default 200")
      ->check(CLI::Range(1, 3000));
  command->add_flag("--cylinder", options->study.cylinder, "the cylinder alone, without the motor in the prediction");
  add_figure_options(*command, options->output);
  command->callback([options, &exit_code] { exit_code = scaling(*options); });
}

}  // namespace solenoid
