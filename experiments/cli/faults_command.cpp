#include "experiments/base/child_process.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/rig/fault_table.hpp"
#include "experiments/rig/node_attack.hpp"

#include <algorithm>
#include <iterator>

#include <CLI/CLI.hpp>

namespace solenoid {
namespace {

struct FaultsArguments {
  OutputOptions output;
  std::string variant = "nine_state";
  bool simulated_only = false, attacks_only = false, image = false;
};

std::vector<ProcessOutcome> in_a_folder(const std::string& variant, bool image = false) {
  const TemporaryFolder folder;
  return process_faults(this_program(), folder.path().string(), variant, image);
}

/// Of the node by those who are not its controller.
int attacks(const FaultsArguments& options) {
  const TemporaryFolder folder;
  const auto table =
      attack_node({.program = this_program(), .folder = folder.path().string(), .variant = options.variant});
  options.output.write(result_of(table));
  return std::ranges::all_of(table, withstood) ? success : failure;
}

int faults(const FaultsArguments& options) {
  if (options.attacks_only) return attacks(options);
  if (options.image) {
    const auto processes = in_a_folder(options.variant, true);
    options.output.write(result_of({}, processes));
    return std::ranges::all_of(processes, [](const auto& p) { return p.refused == 0; }) ? success : failure;
  }
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
  command
      ->add_flag("--attacks-only", options->attacks_only,
                 "attack an emulated node instead, 20,000 packets a second for two seconds each (about a minute)")
      ->excludes("--simulated-only");
  command
      ->add_flag(
          "--image", options->image,
          "with the firmware's image on QEMU's board: the faults of processes, and of sensors and valves in real time "
          "(about four minutes)")
      ->excludes("--simulated-only")
      ->excludes("--attacks-only");
  command->footer(
      "Exit code 1 if any command out of range left the controller, or if an attack was obeyed or not counted.");
  command->callback([options, &exit_code] { exit_code = faults(*options); });
}

}  // namespace solenoid
