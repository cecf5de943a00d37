#include "core/config/reader.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/study/scaling.hpp"
#include "experiments/systems/actuator/scaling/actuator_scaling.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"

#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

namespace solenoid {
namespace {

struct ScalingCommand {
  ScalingOptions study;
  std::string system = systems().front()->name();
  bool cylinder = false;
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

/// The actuator's study has a horizon and motions of its own.
std::vector<ScalingRow> rows_of(ScalingCommand& command) {
  ScalingOptions& study = command.study;
  study.system = find_system(command.system);
  if (!study.system) throw ConfigError(fmt::format("'{}' is no system (allowed: {})", command.system, system_names()));
  const bool actuator = study.system == &actuator_simulation().system();
  if (command.cylinder && !actuator)
    throw ConfigError(fmt::format("--cylinder: {} has none (allowed: the actuator)", command.system));
  study.model = !actuator ? command.system : command.cylinder ? "cylinder" : "hybrid";
  study.title = !actuator ? command.system + ", a period a block"
                          : std::string(command.cylinder ? "Cylinder alone" : "Cylinder and motor in the prediction") +
                                ", horizon 100 ms, switching weight 2e-08";
  return actuator ? study_actuator_scaling(study, command.cylinder, show_size, InterruptGuard::raised)
                  : study_scaling(study, show_size, InterruptGuard::raised);
}

int scaling(ScalingCommand& command) {
  const InterruptGuard guard;
  const auto rows = rows_of(command);
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
  CLI::App* command = app.add_subcommand("scaling", "the search's nodes and time against blocks and modes");
  command->add_option("system", options->system, "one of `list systems`; default the first");
  add_output_options(*command, options->output);
  command->add_option("--instances", options->study.instances, "recorded states a mode set; default 200")
      ->check(CLI::Range(1, 3000));
  command->add_flag("--cylinder", options->cylinder, "the cylinder alone, without the motor in the prediction");
  add_figure_options(*command, options->output);
  command->callback([options, &exit_code] { exit_code = scaling(*options); });
}

}  // namespace solenoid
