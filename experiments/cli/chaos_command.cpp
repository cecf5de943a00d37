#include "experiments/base/child_process.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/rig/chaos.hpp"

#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

struct ChaosArguments {
  OutputOptions output;
  ChaosSettings chaos;
};

int provoke_chaos(const ChaosArguments& options) {
  ChaosSettings settings = options.chaos;
  settings.program = this_program();
  std::optional<TemporaryFolder> folder;
  if (settings.folder.empty()) settings.folder = folder.emplace().path().string();
  const InterruptGuard guard;
  const ChaosOutcome outcome =
      chaos(settings, InterruptGuard::raised, [](const std::string& line) { fmt::print(stderr, "{}\n", line); });
  options.output.write(result_of(outcome));
  return !outcome.findings.empty() ? failure : InterruptGuard::raised() ? interrupted : success;
}

}  // namespace

void add_chaos(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ChaosArguments>();
  CLI::App* command = app.add_subcommand("chaos", "kills, stops, starves campaigns and runs; compares what survives");
  command->add_option("--duration", options->chaos.duration_s, "seconds; default 60")->check(CLI::Range(1.0, 86400.0));
  command->add_option("--seed", options->chaos.seed, "of what happens when; default 1");
  command
      ->add_option("--variant", options->chaos.variant,
                   "a shipped variant of the actuator, what runs in real time; default nine_state")
      ->type_name(value_kind::variant);
  command->add_option("--out", options->chaos.folder, "keep its files in this folder; default: a temporary one")
      ->type_name(value_kind::folder);
  add_output_options(*command, options->output, {"table", "json"});
  command->footer(
      "Signals to the program and its workers, stops, stolen processors, a full disk (as root: on a small file system "
      "of its own), "
      "damaged results, spoilt packets. Exit code 1 if anything was found that must not be.");
  command->callback([options, &exit_code] { exit_code = provoke_chaos(*options); });
}

}  // namespace solenoid
