#include "experiments/base/files.hpp"
#include "experiments/base/text_table.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/sizing/size_output.hpp"

#include <memory>

#include <CLI/CLI.hpp>

namespace solenoid {
namespace {

struct SizeCommand {
  std::string task, format = "text", svg, png;
  std::vector<std::string> settings;
};

void size(const SizeCommand& command) {
  const SizingInput input =
      with_settings(command.task.empty() ? thesis_sizing() : read_sizing_file(command.task), command.settings);
  if (!command.svg.empty()) draw_torque_curve(input, command.svg);
  if (!command.png.empty()) draw_torque_curve(input, command.png);
  write_standard_output(command.format == "json"  ? sizing_json(input)
                        : command.format == "csv" ? sizing_csv(input)
                                                  : sizing_text(input, colour_wanted()));
}

}  // namespace

void add_size(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SizeCommand>();
  CLI::App* command = app.add_subcommand("size", "from a task to bore, motor and gear, by chapter 3 and appendix A");
  command->add_option("task", options->task, "a task's TOML file (docs/how-to/sizing.md); default: the thesis's");
  command->add_option("--set", options->settings, "a key of the task, repeatable: --set arm.payload_kg=1.5");
  command->add_option("--format", options->format, "text, csv or json")->check(CLI::IsMember({"text", "csv", "json"}));
  command->add_option("--svg", options->svg, "write the torque curve, figure 3-3, to this SVG file");
  command->add_option("--png", options->png, "write it to this PNG file");
  command->callback([options, &exit_code] {
    size(*options);
    exit_code = success;
  });
}

}  // namespace solenoid
