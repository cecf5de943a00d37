#include "experiments/cli/slurm_options.hpp"

#include "core/config/one_line.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/campaign/results_folder.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/value_kinds.hpp"

#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr const char* group = "On a cluster";

std::string plan_text(const SlurmPlan& plan) {
  std::size_t tasks = 0;
  for (const SlurmArray& array : plan.arrays) tasks += array.tasks.size();
  return fmt::format("{} of {} runs are missing; {} of {} shards to submit, {} at work", plan.missing, plan.runs, tasks,
                     plan.shards, plan.at_work);
}

/// The scripts as they would be submitted.
void show(const Campaign& campaign, const std::string& folder, const SlurmSettings& settings, const SlurmPlan& plan) {
  std::string text;
  for (const SlurmArray& array : plan.arrays)
    text += array_script(campaign.name, folder, settings, plan.shards, array) + "\n";
  write_standard_output(text + finish_script(campaign.name, folder, settings));
}

/// A plan where there is no cluster to ask.
SlurmPlan plan_without_cluster(const Campaign& campaign, const SlurmSettings& settings) {
  SlurmPlan plan{.shards = settings.nodes > 0 ? settings.nodes : usual_shards(campaign, settings),
                 .runs = campaign.runs.size(),
                 .missing = campaign.runs.size(),
                 .arrays = {{}}};
  for (int shard = 1; shard <= plan.shards; ++shard) plan.arrays.front().tasks.push_back(shard);
  return plan;
}

bool reaches_cluster() {
  try {
    max_array_size();
    return true;
  } catch (const ConfigError& error) {
    fmt::print(stderr, "solenoid: {}; all shards are shown\n", one_line(error.what()));
    return false;
  }
}

/// What there is to submit; where nothing will be, also without a cluster.
SlurmPlan plan_of(const Campaign& campaign, const std::string& folder, const SlurmOptions& options) {
  if (options.dry_run && !reaches_cluster()) return plan_without_cluster(campaign, options.settings);
  return plan_slurm(campaign, folder, options.settings);
}

}  // namespace

void SlurmOptions::require_slurm(const CLI::App& command) const {
  if (wanted) return;
  for (const CLI::Option* option : command.get_options())
    if (option->get_group() == group && option->count() > 0)
      throw ConfigError(
          fmt::format("{}: nothing is submitted without --slurm (allowed: with --slurm)", option->get_name()));
}

void add_slurm_options(CLI::App& command, SlurmOptions& o, bool with_dry_run) {
  SlurmSettings& s = o.settings;
  const auto add = [&](const std::string& name, auto& value, const std::string& help) {
    return command.add_option(name, value, help)->group(group);
  };
  command.add_flag("--slurm", o.wanted, "have a Slurm cluster do the runs, as an array job: docs/how-to/cluster.md")
      ->group(group);
  add("--partition", s.partition, "of the cluster; default: the site's");
  add("--time", s.time, "limit of a task, as sbatch takes it: 30:00, 2:00:00; it goes on where it was ended");
  add("--mem", s.memory, "memory of a task, as sbatch takes it: 2G");
  add("--nodes", s.nodes, "array tasks that the runs are shared among, each on a node; default: of ten minutes each")
      ->check(CLI::Range(1, 100000));
  add("--throttle", s.throttle, "array tasks at a time, at most")->check(CLI::Range(1, 100000));
  add("--sbatch", s.sbatch, "a further option of sbatch, repeatable: --sbatch=--account=mine")->allow_extra_args(false);
  if (with_dry_run) command.add_flag("--dry-run", o.dry_run, "print the scripts and submit nothing")->group(group);
}

int submit_campaign(const Campaign& campaign, const std::string& folder, const SlurmOptions& options) {
  std::optional<FolderLock> lock;  // two submissions at once would submit everything twice
  if (!options.dry_run) {
    create_folder(folder + "/slurm");
    lock.emplace(folder + "/slurm", FileLock::alone);
  }
  const SlurmPlan plan = plan_of(campaign, folder, options);
  fmt::print(stderr, "solenoid: {}\n", plan_text(plan));
  if (options.dry_run) return show(campaign, folder, options.settings, plan), success;
  const bool only_finish = plan.at_work > 0 && plan.before.lacks_finish();
  if (plan.arrays.empty() && !only_finish) {
    const std::string then = plan.missing > 0                  ? "solenoid status " + folder
                             : options.settings.finish.empty() ? "solenoid merge " + folder
                                                               : "the same without --slurm makes the tables";
    fmt::print(stderr, "solenoid: nothing to submit; {}\n", then);
    return success;
  }
  const SlurmJobs jobs = submit(campaign, folder, options.settings, plan);
  std::string said;
  for (std::size_t i = jobs.arrays.size() - plan.arrays.size(); i < jobs.arrays.size(); ++i)
    said += fmt::format("array job {}, ", jobs.arrays[i].id);
  write_standard_output(fmt::format("{}finishing job {}\nResults: {}\n", said, jobs.finish, folder));
  fmt::print(stderr, "solenoid: solenoid status {} says how far it is; the same command submits what is missing then\n",
             folder);
  return success;
}

}  // namespace solenoid
