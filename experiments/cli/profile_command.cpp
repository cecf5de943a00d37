#include "experiments/base/interrupt.hpp"
#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/profile/profiling.hpp"

#include <cstdio>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

namespace solenoid {
namespace {

struct ProfileArguments {
  ProfileTask task;
  OutputOptions output;
};

void show_pass(int pass, std::size_t settled, std::size_t variants) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  if (terminal) fmt::print(stderr, "\r\033[Kprofile: pass {}, {} of {} variants settled", pass, settled, variants);
  if (terminal && settled == variants) fmt::print(stderr, "\r\033[K");
  std::fflush(stderr);
}

int profile_and_print(ProfileArguments arguments) {
  const InterruptGuard guard;
  ProfileTask& task = arguments.task;
  task.options.interrupted = InterruptGuard::raised;
  task.options.progress = show_pass;
  task.tell = [](const std::string& line) { std::fprintf(stderr, "%s\n", line.c_str()); };
  const std::optional<ProfileResult> result = profile(task);
  if (!result) return interrupted;
  arguments.output.write(result_of(*result));
  if (!result->change || !result->change->slower()) return success;
  for (const VariantChange& c : result->change->variants)
    if (c.slower) std::fprintf(stderr, "solenoid: %s is slower than in %s\n", c.name.c_str(), task.against.c_str());
  return failure;
}

void add_measuring(CLI::App& command, ProfileArguments& options) {
  command.add_option("--core", options.task.options.core, "core to run on; default: the last this process may use")
      ->check(CLI::Range(0, 1023));
  command
      .add_option("--passes", options.task.options.passes, "passes over the instances; default: until figures settle")
      ->check(CLI::Range(1, 10000));
  command.add_option("--limit-ms", options.task.options.limit_ms, "count misses at this too; default 1")
      ->check(CLI::Range(0.0001, 60000.0));
  command.add_option("--per-variant", options.task.per_variant, "instances to record of each variant; default 700")
      ->check(CLI::Range(1, 1000000));
  command.add_option("--budget", options.task.budgets_ms, "closed loops with every solve cut at these times [ms]")
      ->delimiter(',')
      ->check(CLI::Range(0.0001, 60000.0));
  add_figure_options(command, options.output, "the quality curve");
  for (const char* figure : {"--svg", "--png"}) command.get_option(figure)->needs(command.get_option("--budget"));
}

}  // namespace

void add_profile(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ProfileArguments>();
  CLI::App* command = app.add_subcommand("profile", "solver time on recorded problems, and where it goes");
  CLI::Option* campaign =
      command
          ->add_option("campaign", options->task.campaign,
                       "record the problems of this campaign, or of a run's log.mcap; default: shipped ones")
          ->type_name(value_kind::campaign_or_log);
  CLI::Option* record = command->add_option("--record", options->task.record, "keep the recorded problems in this file")
                            ->type_name(value_kind::file);
  command->add_option("--instances", options->task.instances, "replay this file of problems")
      ->type_name(value_kind::file)
      ->excludes(campaign)
      ->excludes(record);
  command->add_option("--variant", options->task.selection.variants, "only these variants")
      ->type_name(value_kind::variant)
      ->delimiter(',');
  command->add_option("--scenario", options->task.selection.scenarios, "only these scenarios of the campaign")
      ->type_name(value_kind::scenario)
      ->delimiter(',');
  add_measuring(*command, *options);
  command->add_option("--save", options->task.save, "keep this profile for a later --against")
      ->type_name(value_kind::file);
  command->add_option("--against", options->task.against, "compare with an earlier profile; exit code 1 if slower")
      ->type_name(value_kind::file);
  command->add_option("--threshold", options->task.threshold, "ratio that counts as slower; default 1.2")
      ->check(CLI::Range(1.0, 1000.0));
  add_output_options(*command, options->output);
  command->callback([options, &exit_code] { exit_code = profile_and_print(*options); });
}

}  // namespace solenoid
