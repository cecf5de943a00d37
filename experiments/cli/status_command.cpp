#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/cluster/status.hpp"

#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

struct StatusArguments {
  std::string folder;
  bool whole = false;
  OutputOptions output;
};

int run_status(const StatusArguments& options) {
  const CampaignStatus status = status_of(options.folder);
  for (const std::string& problem : status.problems) fmt::print(stderr, "solenoid: {}\n", problem);
  options.output.write(result_of(status));
  return options.whole && status.left > 0 ? failure : success;
}

}  // namespace

void add_status(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<StatusArguments>();
  CLI::App* command =
      app.add_subcommand("status", "how far the campaign of a folder is: runs done, failed and left, time to go");
  command->add_option("folder", options->folder, "results folder of `compare`")
      ->type_name(value_kind::folder)
      ->required();
  command->add_flag("--whole", options->whole, "exit code 1 while runs are missing, for scripts");
  add_output_options(*command, options->output, {"table", "json"});
  command->callback([options, &exit_code] { exit_code = run_status(*options); });
}

}  // namespace solenoid
