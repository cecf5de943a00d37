#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/rig/emulator.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"

#include <csignal>
#include <cstdio>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

struct EmulatorArguments {
  std::string campaign = "rig", scenario = "cycloidal", variant = "nine_state", report;
  std::vector<std::string> faults;
  EmulatorSettings emulator;
};

/// A real-time thread leaves signals to the others of its process; the emulator's is the only one.
void hear_interrupts() {
  sigset_t interrupts;
  sigemptyset(&interrupts);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&interrupts, signal);
  pthread_sigmask(SIG_UNBLOCK, &interrupts, nullptr);
}

int emulate(const EmulatorArguments& chosen) {
  EmulatorArguments options = chosen;
  options.emulator.faults = parse_faults(options.faults, actuator_simulation());
  const Campaign campaign = read_campaign(options.campaign, {{options.variant}, {options.scenario}});
  const VariantConfig& variant = campaign.variants.front();
  const ScenarioConfig& scenario = campaign.scenarios.front();
  require_rig(scenario, "emulator");
  const ModeSet modes = system_of(variant).modes(variant);
  EmulatedNode node(
      [&](std::uint64_t session) {
        const std::uint64_t seed = options.emulator.seed + session - 1;
        return std::make_unique<FaultyPlant>(make_plant(variant, scenario, seed), options.emulator.faults,
                                             told(variant, scenario), seed);
      },
      Calibration{}, (SwitchPattern{1} << modes.switch_count()) - 1);
  const InterruptGuard guard;
  serve(node, options.emulator, InterruptGuard::raised, [&](const std::string& setup) {
    hear_interrupts();
    fmt::print(stderr, "emulator: {} on 127.0.0.1:{}, {} valves, {}\n", scenario.name, options.emulator.port,
               variant.modes, setup);
  });
  const std::string report = node_report(node);
  if (options.report.empty())
    write_standard_output(report);
  else
    write_file_atomically(options.report, report);
  return success;
}

}  // namespace

void add_emulator(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<EmulatorArguments>();
  CLI::App* command = app.add_subcommand("emulator", "the rig as a separate process: the twin behind the UDP protocol");
  command->add_option("--campaign", options->campaign, "where its plant is from; default rig")
      ->type_name(value_kind::campaign);
  command->add_option("--scenario", options->scenario, "whose plant it is; default cycloidal")
      ->type_name(value_kind::scenario);
  command->add_option("--variant", options->variant, "whose valves it has; default nine_state")
      ->type_name(value_kind::variant);
  command->add_option("--port", options->emulator.port, "UDP port on 127.0.0.1; default 47811")
      ->check(CLI::Range(1, 65535));
  command->add_option("--seed", options->emulator.seed, "of its noise; counts up with each session; default 1");
  command->add_option("--fault", options->faults,
                      "a fault by script, repeatable: " + fault_help(actuator_simulation()));
  command->add_option("--report", options->report, "write what it has seen to this JSON file; default: standard output")
      ->type_name(value_kind::file);
  command->add_option("--idle-exit", options->emulator.idle_exit_s, "end after so many seconds without a packet")
      ->check(CLI::Range(0.1, 3600.0));
  command->callback([options, &exit_code] { exit_code = emulate(*options); });
}

}  // namespace solenoid
