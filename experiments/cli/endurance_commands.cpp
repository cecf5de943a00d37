// `chaos` and `soak`: what holds when it lasts.
#include "experiments/base/child_process.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/rig/chaos.hpp"
#include "experiments/rig/soak.hpp"

#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

template <class Settings>
struct EnduranceArguments {
  OutputOptions output;
  Settings settings;
};

template <class Settings>
std::shared_ptr<EnduranceArguments<Settings>> add_endurance_options(CLI::App& command, const std::string& variants) {
  auto options = std::make_shared<EnduranceArguments<Settings>>();
  Settings& settings = options->settings;
  command.add_option("--duration", settings.duration_s, "seconds; default 60")->check(CLI::Range(1.0, 86400.0));
  command.add_option("--variant", settings.variant, variants + "; default nine_state")->type_name(value_kind::variant);
  command.add_option("--out", settings.folder, "keep its files in this folder; default: a temporary one")
      ->type_name(value_kind::folder);
  add_output_options(command, options->output, {"table", "json"});
  return options;
}

/// In a temporary folder where none is given.
template <class Settings, class Endure>
int endure(const EnduranceArguments<Settings>& options, const Endure& of) {
  Settings settings = options.settings;
  settings.program = this_program();
  std::optional<TemporaryFolder> folder;
  if (settings.folder.empty()) settings.folder = folder.emplace().path().string();
  const InterruptGuard guard;
  const auto outcome = of(settings);
  options.output.write(result_of(outcome));
  return !outcome.findings.empty() ? failure : InterruptGuard::raised() ? interrupted : success;
}

ChaosOutcome told_chaos(const ChaosSettings& settings) {
  return chaos(settings, InterruptGuard::raised, [](const std::string& line) { fmt::print(stderr, "{}\n", line); });
}

SoakOutcome told_soak(const SoakSettings& settings) {
  return soak(settings, InterruptGuard::raised, [](const SoakOutcome::Look& look) {
    fmt::print(stderr, "{:7.0f} s: run {} kB, node {} kB\n", look.time_s, look.run_kb, look.node_kb);
  });
}

}  // namespace

void add_chaos(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("chaos", "kills, stops, starves campaigns and runs; compares what survives");
  auto options =
      add_endurance_options<ChaosSettings>(*command, "a shipped variant of the actuator, what runs in real time");
  command->add_option("--seed", options->settings.seed, "of what happens when; default 1");
  command->footer(
      "Signals to the program and its workers, stops, stolen processors, a full disk (as root: on a small file system "
      "of its own), damaged results, spoilt packets. Exit code 1 if anything was found that must not be.");
  command->callback([options, &exit_code] { exit_code = endure(*options, told_chaos); });
}

void add_soak(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("soak", "a long run under load: memory, ticks, phase");
  auto options = add_endurance_options<SoakSettings>(*command, "a shipped variant that is real time");
  command->add_option("--load", options->settings.load, "threads of other work; default 2")->check(CLI::Range(0, 1024));
  command->footer("Exit code 1 if memory grew, a tick was not accounted for, or the run did not end as told.");
  command->callback([options, &exit_code] { exit_code = endure(*options, told_soak); });
}

}  // namespace solenoid
