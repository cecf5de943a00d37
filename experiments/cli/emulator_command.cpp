#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/rig/emulator.hpp"
#include "experiments/rig/image_node.hpp"
#include "experiments/rig/plants.hpp"
#include "experiments/rig/udp_io.hpp"

#include <cstdio>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

struct EmulatorArguments {
  std::string campaign, scenario, variant = "nine_state", report, key_file;
  std::vector<std::string> faults;
  EmulatorSettings emulator;
  std::optional<std::string> image;
};

void write_report(const EmulatorArguments& options, const std::string& report) {
  if (options.report.empty())
    write_standard_output(report);
  else
    write_file_atomically(options.report, report);
}

int emulate(const EmulatorArguments& chosen) {
  EmulatorArguments options = chosen;
  const Campaign campaign = read_real_time_task(options.campaign, options.variant, options.scenario);
  const ScenarioConfig& scenario = campaign.scenarios.front();
  const VariantConfig variant = told(campaign.variants.front(), scenario);
  options.emulator.faults = parse_faults(options.faults, simulation_of(scenario));
  std::optional<NodeKey> key;
  if (!options.key_file.empty()) key = read_node_key(options.key_file);
  const std::uint64_t seed = options.emulator.seed;
  auto plant =
      std::make_unique<FaultyPlant>(make_plant(variant, scenario, seed), options.emulator.faults, variant, seed);
  const Calibration calibration = usual_calibration(variant);
  const ModeSet modes = system_of(variant).modes(variant);
  const std::string wire = node_wire(variant).text;
  const SystemDescription& system = campaign.system->description();
  const InterruptGuard guard;
  const auto listening = [&](const std::string& setup) {
    InterruptGuard::hear();  // the only thread is a real-time one
    fmt::print(stderr, "emulator: {} on 127.0.0.1:{}, {} {}, {}, {}\n", scenario.name, options.emulator.port,
               variant.modes, system.modes_key, key ? "with a key" : "without a key", setup);
  };
  if (options.image) {
    ImageNode node(std::move(plant), calibration, node_description(calibration, modes, wire, key ? &*key : nullptr),
                   options.emulator, {*options.image, options.emulator.priority});
    serve(node, options.emulator, InterruptGuard::raised, listening);
    write_report(options, image_report(node, system));
    return success;
  }
  EmulatedNode node(std::move(plant), calibration, modes, wire, key);
  const std::int64_t dropped = serve(node, options.emulator, InterruptGuard::raised, listening);
  write_report(options, node_report(node, system, dropped));
  return success;
}

}  // namespace

void add_emulator(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<EmulatorArguments>();
  CLI::App* command = app.add_subcommand("emulator", "the rig as a separate process: the twin behind the UDP protocol");
  command
      ->add_option("--campaign", options->campaign,
                   "where its plant is from; default: of the variant's system, of the actuator rig")
      ->type_name(value_kind::campaign);
  command->add_option("--scenario", options->scenario, "whose plant it is; default the campaign's first")
      ->type_name(value_kind::scenario);
  command->add_option("--variant", options->variant, "whose switches it has; default nine_state")
      ->type_name(value_kind::variant);
  command->add_option("--port", options->emulator.port, "UDP port on 127.0.0.1; default 47811")
      ->check(CLI::Range(1, 65535));
  command->add_option("--seed", options->emulator.seed, "of its noise; default 1");
  command->add_option("--fault", options->faults,
                      "a fault by script, repeatable: " + fault_help(simulation_of(*systems().front())));
  command->add_option("--report", options->report, "write what it has seen to this JSON file; default: standard output")
      ->type_name(value_kind::file);
  command
      ->add_option_function<std::string>(
          "--image", [options](const std::string& file) { options->image = file; },
          "the firmware itself: its image on QEMU's board instead of the same code in this process; without a file the "
          "one "
          "that was built with this program")
      ->expected(0, 1)
      ->type_name(value_kind::file);
  command->add_option("--key", options->key_file, "file of the key that controllers must have (docs/reference/rig.md)")
      ->type_name(value_kind::file);
  command->add_option("--idle-exit", options->emulator.idle_exit_s, "end after so many seconds without a packet")
      ->check(CLI::Range(0.1, 3600.0));
  command->callback([options, &exit_code] { exit_code = emulate(*options); });
}

}  // namespace solenoid
