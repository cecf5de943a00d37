#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/systems/actuator/sizing/size_output.hpp"

#include <memory>

#include <CLI/CLI.hpp>

namespace solenoid {
namespace {

struct SizeCommand {
  std::string task;
  std::vector<std::string> settings;
  OutputOptions output;
};

}  // namespace

void add_size(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SizeCommand>();
  CLI::App* command = app.add_subcommand("size", "from a task to bore, motor and gear, by chapter 3 and appendix A");
  command->add_option("task", options->task, "a task's TOML file (docs/how-to/sizing.md); default: the thesis's")
      ->type_name(value_kind::toml);
  command->add_option("--set", options->settings, "a key of the task, repeatable: --set arm.payload_kg=1.5");
  add_output_options(*command, options->output, {"text", "csv", "json"});
  add_figure_options(*command, options->output, "the torque curve, figure 3-3,");
  command->callback([options, &exit_code] {
    const SizingInput task = options->task.empty() ? thesis_sizing() : read_sizing_file(options->task);
    options->output.write(result_of(with_settings(task, options->settings)));
    exit_code = success;
  });
}

}  // namespace solenoid
