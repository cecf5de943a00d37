#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/read_log.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/profile/profile_report.hpp"
#include "experiments/profile/record.hpp"
#include "experiments/profile/shipped_instances.hpp"
#include "experiments/report/headings.hpp"
#include "experiments/rig/replay_run.hpp"

#include <algorithm>
#include <cstdio>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

namespace solenoid {
namespace {

struct ProfileArguments {
  std::string campaign, instances, record, save, against;
  OutputOptions output;
  Selection selection;
  std::size_t per_variant = 700;
  std::vector<double> budgets_ms;
  double threshold = 1.2;
  ProfileOptions profile;
};

bool is_log(const ProfileArguments& options) { return options.campaign.ends_with(".mcap"); }

/// The instances to replay, recorded or read, and where they are from.
InstanceSet instances_of(const ProfileArguments& options, std::string& source) {
  if (is_log(options)) {
    source = fmt::format("instances posed by the measurements of {}", options.campaign);
    return record_instances(read_log(options.campaign), options.selection.variants, options.per_variant,
                            InterruptGuard::raised);
  }
  if (!options.campaign.empty() || !options.record.empty()) {
    const std::string name = options.campaign.empty() ? "profile" : options.campaign;
    source = fmt::format("instances recorded from campaign {}", name);
    std::fprintf(stderr, "profile: recording closed loops\n");
    return record_instances(read_campaign(name, options.selection), options.per_variant);
  }
  const bool shipped = options.instances.empty();
  source = shipped ? "the shipped instances" : options.instances;
  return shipped ? parse_instances(shipped_instance_bytes(), shipped_instances_name)
                 : read_instances(options.instances);
}

/// Leaves only the variants asked for.
void select_variants(const std::vector<std::string>& wanted, InstanceSet& set) {
  if (wanted.empty()) return;
  std::vector<std::string> names;
  for (const VariantInstances& v : set.variants) names.push_back(v.name);
  for (const std::string& name : wanted)
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw ConfigError(
          fmt::format("--variant: '{}' has no instances there (allowed: {})", name, fmt::join(names, ", ")));
  std::erase_if(set.variants,
                [&](const auto& v) { return std::find(wanted.begin(), wanted.end(), v.name) == wanted.end(); });
}

void show_pass(int pass, std::size_t settled, std::size_t variants) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  if (terminal) fmt::print(stderr, "\r\033[Kprofile: pass {}, {} of {} variants settled", pass, settled, variants);
  if (terminal && settled == variants) fmt::print(stderr, "\r\033[K");
  std::fflush(stderr);
}

/// The closed loops of the quality curve: the campaign's or the log's task, or those the shipped instances come from.
std::vector<QualityPoint> quality_of(const ProfileArguments& options, ProfileResult& result) {
  if (options.budgets_ms.empty()) return {};
  const Campaign campaign =
      is_log(options) ? recorded_campaign(read_log(options.campaign), options.selection.variants)
                      : read_campaign(options.campaign.empty() ? "profile" : options.campaign, options.selection);
  const MetricColumn& judged = judged_metric(campaign.system->description());
  result.judged = judged.key;
  result.judged_heading = judged.heading;
  std::fprintf(stderr, "profile: closed loops at %zu budgets\n", options.budgets_ms.size());
  return quality_against_time(campaign, options.budgets_ms, options.profile.core, InterruptGuard::raised);
}

int profile(ProfileArguments options) {
  const InterruptGuard guard;
  ProfileResult result;
  result.threshold = options.threshold;
  Profile then;
  if (!options.against.empty()) then = read_profile(options.against);
  InstanceSet set = instances_of(options, result.source);
  if (InterruptGuard::raised()) return interrupted;
  if (!options.record.empty()) write_file_atomically(options.record, instance_bytes(set));
  select_variants(options.selection.variants, set);
  options.profile.interrupted = InterruptGuard::raised;
  options.profile.progress = show_pass;
  result.profile = profile_instances(set, options.profile);
  if (!result.profile.interrupted) result.quality = quality_of(options, result);
  if (result.profile.interrupted || InterruptGuard::raised()) return interrupted;
  if (!options.against.empty())
    result.change = compare_profiles(result.profile, then, options.against, options.threshold);
  if (!options.save.empty()) write_file_atomically(options.save, result_of(result, true).json());
  options.output.write(result_of(result));
  if (!result.change || !result.change->slower()) return success;
  for (const VariantChange& c : result.change->variants)
    if (c.slower) std::fprintf(stderr, "solenoid: %s is slower than in %s\n", c.name.c_str(), options.against.c_str());
  return failure;
}

void add_measuring(CLI::App& command, ProfileArguments& options) {
  command.add_option("--core", options.profile.core, "core to run on; default: the last this process may use")
      ->check(CLI::Range(0, 1023));
  command.add_option("--passes", options.profile.passes, "passes over the instances; default: until figures settle")
      ->check(CLI::Range(1, 10000));
  command.add_option("--limit-ms", options.profile.limit_ms, "count misses at this too; default 1")
      ->check(CLI::Range(0.0001, 60000.0));
  command.add_option("--per-variant", options.per_variant, "instances to record of each variant; default 700")
      ->check(CLI::Range(1, 1000000));
  command.add_option("--budget", options.budgets_ms, "closed loops with every solve cut at these times [ms]")
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
          ->add_option("campaign", options->campaign,
                       "record the problems of this campaign, or of a run's log.mcap; default: shipped ones")
          ->type_name(value_kind::campaign_or_log);
  CLI::Option* record = command->add_option("--record", options->record, "keep the recorded problems in this file")
                            ->type_name(value_kind::file);
  command->add_option("--instances", options->instances, "replay this file of problems")
      ->type_name(value_kind::file)
      ->excludes(campaign)
      ->excludes(record);
  command->add_option("--variant", options->selection.variants, "only these variants")
      ->type_name(value_kind::variant)
      ->delimiter(',');
  command->add_option("--scenario", options->selection.scenarios, "only these scenarios of the campaign")
      ->type_name(value_kind::scenario)
      ->delimiter(',');
  add_measuring(*command, *options);
  command->add_option("--save", options->save, "keep this profile for a later --against")->type_name(value_kind::file);
  command->add_option("--against", options->against, "compare with an earlier profile; exit code 1 if slower")
      ->type_name(value_kind::file);
  command->add_option("--threshold", options->threshold, "ratio that counts as slower; default 1.2")
      ->check(CLI::Range(1.0, 1000.0));
  add_output_options(*command, options->output);
  command->callback([options, &exit_code] { exit_code = profile(*options); });
}

}  // namespace solenoid
