#pragma once

#include "experiments/campaign/campaign.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace solenoid {

/// What a campaign asks of Slurm. Texts are handed to sbatch as they are; empty: the site's default.
struct SlurmSettings {
  std::string partition = {}, time = {}, memory = {};
  int nodes = 0;     ///< array tasks that the campaign is parted into, each on a node; 0: of about ten minutes each
  int throttle = 0;  ///< of them at a time; 0: as many as there is room for
  int cores = 1;     ///< of a task
  std::string scratch = {};              ///< a folder of the node that a shard grows in; none: $TMPDIR, or /tmp
  std::vector<std::string> sbatch = {};  ///< further options
  std::string traces = "none";           ///< as TraceKeeping reads it
  double tick_limit_s = 600.0;
  std::vector<std::string> finish = {};  ///< arguments of the program once all tasks have ended; none: merge
  bool finishes = true;                  ///< whether that is done at all
  std::string program = {};              ///< that all tasks run; none: a copy of this one in the folder
};

/// An array job, as many tasks as MaxArraySize allows at most.
struct SlurmArray {
  int first = 0;           ///< task T does shard first + T
  std::vector<int> tasks;  ///< ascending, from 1
};

/// The state of a task as Slurm tells it.
struct SlurmTask {
  std::string state;  ///< RUNNING, PENDING, COMPLETED, FAILED, TIMEOUT, NODE_FAIL ...
  std::string node, reason;
  int restarts = 0;
  bool over() const;  ///< it ended, one way or another
  bool waits() const { return state == "PENDING" || state == "SUSPENDED" || state.starts_with("REQUEUE"); }
  bool runs() const { return !over() && !waits(); }
};

/// Jobs that were submitted for a folder: FOLDER/slurm/jobs.json.
struct SlurmJobs {
  struct Array {
    std::int64_t id = 0;
    int first = 0;  ///< SlurmArray::first
  };
  int shards = 0, cores = 1;
  std::vector<Array> arrays;
  std::int64_t finish = 0;  ///< the latest job that waits for the arrays, 0: none

  /// Empty if there are none. Throws ConfigError naming the file for what is no such file.
  static SlurmJobs of(const std::string& folder);
  void write(const std::string& folder) const;
  /// Whether no job waits for the latest array: a submission broke off.
  bool lacks_finish() const { return !arrays.empty() && finish < arrays.back().id; }
  /// The latest state of each shard's task that Slurm still knows; asks squeue. Throws ConfigError if that does not answer.
  /// `known` gets the arrays that it knows.
  std::map<int, SlurmTask> tasks(std::set<std::int64_t>* known = nullptr) const;
};

/// What is submitted, and why nothing more.
struct SlurmPlan {
  SlurmJobs before = {};  ///< jobs that were submitted for the folder and that Slurm still knows
  int shards = 0;
  std::size_t runs = 0, missing = 0;  ///< of the campaign; those that no file has
  std::vector<SlurmArray> arrays;     ///< of shards with missing runs that no job is at
  std::size_t at_work = 0;            ///< shards with missing runs that a job is at already
};

/// MaxArraySize of the cluster: one more than the highest index of an array.
int max_array_size();

/// The shards of about ten minutes each that a campaign is parted into unless one says.
int usual_shards(const Campaign& campaign, const SlurmSettings& settings);

/// What there is to submit for a campaign into its folder.
SlurmPlan plan_slurm(const Campaign& campaign, const std::string& folder, const SlurmSettings& settings);

/// The array's script, and that of the job which waits for it.
std::string array_script(const std::string& name, const std::string& folder, const SlurmSettings& settings, int shards,
                         const SlurmArray& array);
std::string finish_script(const std::string& name, const std::string& folder, const SlurmSettings& settings);

/// The program's copy in a folder, with those of its plug-ins beside it, made if there is none or another, so that what is
/// built while tasks run makes no other results. Throws OutputError.
std::string program_copy(const std::string& folder);

/// Writes the folder's part of the cluster (the program itself, scripts, jobs.json) and submits the arrays and, after
/// them, the finishing job. Throws ConfigError with Slurm's own words if it refuses.
SlurmJobs submit(const Campaign& campaign, const std::string& folder, const SlurmSettings& settings,
                 const SlurmPlan& plan);

}  // namespace solenoid
