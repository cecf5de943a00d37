#include "experiments/profile/profiling.hpp"

#include "core/config/document.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/result.hpp"
#include "experiments/profile/record.hpp"
#include "experiments/profile/shipped_instances.hpp"
#include "experiments/report/headings.hpp"
#include "experiments/rig/replay_run.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

bool is_of_log(const ProfileTask& task) { return task.campaign.ends_with(".mcap"); }

RecordedRun read_told_log(const ProfileTask& task) {
  RecordedRun run = read_run(task.campaign);
  if (!run.problem.empty()) task.tell(fmt::format("solenoid: {}: {}", task.campaign, run.problem));
  return run;
}

Campaign campaign_of(const ProfileTask& task) {
  if (task.document) return read_campaign(*task.document, task.selection);
  return read_campaign(task.campaign.empty() ? "profile" : task.campaign, task.selection);
}

/// The instances to replay, recorded or read, and where they are from.
InstanceSet instances_of(const ProfileTask& task, std::string& source) {
  if (is_of_log(task)) {
    source = fmt::format("instances posed by the measurements of {}", task.campaign);
    const RecordedRun run = read_told_log(task);
    if (!task.record.empty()) require_carried(recorded_campaign(run, task.selection.variants));
    return record_instances(run, task.selection.variants, task.per_variant, task.options.interrupted);
  }
  if (task.document || !task.campaign.empty() || !task.record.empty()) {
    const Campaign campaign = campaign_of(task);
    source = fmt::format("instances recorded from campaign {}",
                         task.document || task.campaign.empty() ? campaign.name : task.campaign);
    if (!task.record.empty()) require_carried(campaign);
    task.tell("profile: recording closed loops");
    return record_instances(campaign, task.per_variant, task.options.interrupted);
  }
  source = task.set ? "instances in memory" : task.instances.empty() ? "the shipped instances" : task.instances;
  return task.set ? *task.set : instances_from(task.instances);
}

/// The closed loops of the quality curve: the campaign's or the log's task, or those the shipped instances come from.
std::vector<QualityPoint> quality_of(const ProfileTask& task, ProfileResult& result) {
  if (task.budgets_ms.empty()) return {};
  const Campaign campaign =
      is_of_log(task) ? recorded_campaign(read_told_log(task), task.selection.variants) : campaign_of(task);
  const MetricColumn& judged = judged_metric(campaign.system->description());
  result.judged = judged.key;
  result.judged_heading = judged.heading;
  task.tell(fmt::format("profile: closed loops at {} budgets", task.budgets_ms.size()));
  return quality_against_time(campaign, task.budgets_ms, task.options.core, task.options.interrupted);
}

}  // namespace

InstanceSet instances_from(const std::string& path) {
  return path.empty() ? parse_instances(shipped_instance_bytes(), shipped_instances_name) : read_instances(path);
}

void select_variants(const std::vector<std::string>& wanted, InstanceSet& set) {
  if (wanted.empty()) return;
  std::vector<std::string> names;
  for (const VariantInstances& v : set.variants) names.push_back(v.name);
  for (const std::string& name : wanted)
    if (std::ranges::find(names, name) == names.end())
      throw ConfigError(
          fmt::format("--variant: '{}' has no instances there (allowed: {})", name, fmt::join(names, ", ")));
  std::erase_if(set.variants, [&](const auto& v) { return std::ranges::find(wanted, v.name) == wanted.end(); });
}

std::optional<ProfileResult> profile(const ProfileTask& task) {
  ProfileResult result;
  result.threshold = task.threshold;
  Profile then;
  if (!task.against.empty()) then = read_profile(task.against);
  InstanceSet set = instances_of(task, result.source);
  if (task.options.interrupted()) return std::nullopt;
  if (!task.record.empty()) write_file_atomically(task.record, instance_bytes(set));
  select_variants(task.selection.variants, set);
  result.profile = profile_instances(set, task.options);
  if (!result.profile.interrupted) result.quality = quality_of(task, result);
  if (result.profile.interrupted || task.options.interrupted()) return std::nullopt;
  if (!task.against.empty()) result.change = compare_profiles(result.profile, then, task.against, task.threshold);
  if (!task.save.empty()) write_file_atomically(task.save, result_of(result, true).json());
  return result;
}

}  // namespace solenoid
