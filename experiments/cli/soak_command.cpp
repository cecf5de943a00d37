#include "experiments/base/child_process.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/rig/soak.hpp"

#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

struct SoakArguments {
  OutputOptions output;
  SoakSettings soak;
};

int soak_under_load(const SoakArguments& options) {
  SoakSettings settings = options.soak;
  settings.program = this_program();
  std::optional<TemporaryFolder> folder;
  if (settings.folder.empty()) settings.folder = folder.emplace().path().string();
  const InterruptGuard guard;
  const SoakOutcome outcome = soak(settings, InterruptGuard::raised, [](const SoakOutcome::Look& look) {
    fmt::print(stderr, "{:7.0f} s: run {} kB, node {} kB\n", look.time_s, look.run_kb, look.node_kb);
  });
  options.output.write(result_of(outcome));
  return InterruptGuard::raised() ? interrupted : outcome.findings.empty() ? success : failure;
}

}  // namespace

void add_soak(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<SoakArguments>();
  CLI::App* command = app.add_subcommand("soak", "a long run under load: memory, ticks, phase");
  command->add_option("--duration", options->soak.duration_s, "seconds; default 60")->check(CLI::Range(1.0, 86400.0));
  command->add_option("--load", options->soak.load, "threads of other work; default 2")->check(CLI::Range(0, 1024));
  command->add_option("--variant", options->soak.variant, "a shipped variant that is real time; default nine_state")
      ->type_name(value_kind::variant);
  command->add_option("--out", options->soak.folder, "keep its files in this folder; default: a temporary one")
      ->type_name(value_kind::folder);
  add_output_options(*command, options->output, {"table", "json"});
  command->footer("Exit code 1 if memory grew, a tick was not accounted for, or the run did not end as told.");
  command->callback([options, &exit_code] { exit_code = soak_under_load(*options); });
}

}  // namespace solenoid
