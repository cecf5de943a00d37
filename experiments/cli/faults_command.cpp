#include "experiments/base/child_process.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/rig/fault_table.hpp"

#include <algorithm>
#include <iterator>

#include <CLI/CLI.hpp>

namespace solenoid {
namespace {

struct FaultsArguments {
  OutputOptions output;
  std::string variant = "nine_state";
  bool simulated_only = false;
};

std::vector<ProcessOutcome> in_a_folder(const std::string& variant) {
  const TemporaryFolder folder;
  return process_faults(this_program(), folder.path().string(), variant);
}

int faults(const FaultsArguments& options) {
  auto simulated = simulated_faults(options.variant);
  std::ranges::move(coil_faults(options.variant), std::back_inserter(simulated));
  const auto processes = options.simulated_only ? std::vector<ProcessOutcome>{} : in_a_folder(options.variant);
  options.output.write(result_of(simulated, processes));
  const bool good = std::all_of(simulated.begin(), simulated.end(), [](const auto& f) { return f.in_range; }) &&
                    std::all_of(processes.begin(), processes.end(), [](const auto& p) { return p.refused == 0; });
  return good ? success : failure;
}

}  // namespace

void add_faults(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<FaultsArguments>();
  CLI::App* command =
      app.add_subcommand("faults", "provokes every fault of sensors, coils, solver, processes; what they lead to");
  command->add_option("--variant", options->variant, "a shipped variant that is real time; default nine_state")
      ->type_name(value_kind::variant);
  add_output_options(*command, options->output, {"table", "json"});
  command->add_flag("--simulated-only", options->simulated_only, "leave out the faults of processes (about a minute)");
  command->footer("Exit code 1 if any command out of range left the controller.");
  command->callback([options, &exit_code] { exit_code = faults(*options); });
}

}  // namespace solenoid
