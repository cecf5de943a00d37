#include "experiments/base/files.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/read_log.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/rig/log/tick_fields.hpp"

#include <memory>

#include <CLI/CLI.hpp>

namespace solenoid {
namespace {

struct ExportArguments {
  std::string log, csv;
};

int export_log(const ExportArguments& options) {
  const RecordedRun run = read_log(options.log);
  const std::string text = TickFormat(*run.system).csv_text(run.ticks);
  if (options.csv.empty())
    write_standard_output(text);
  else
    write_file_atomically(options.csv, text);
  return success;
}

}  // namespace

void add_export(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ExportArguments>();
  CLI::App* command = app.add_subcommand("export", "a run's log as CSV");
  command->add_option("log", options->log, "an .mcap file of `run`")->type_name(value_kind::log)->required();
  command->add_option("--csv", options->csv, "to this file; default: standard output")->type_name(value_kind::csv);
  command->callback([options, &exit_code] { exit_code = export_log(*options); });
}

}  // namespace solenoid
