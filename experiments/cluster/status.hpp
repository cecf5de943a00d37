#pragma once

#include "experiments/base/result.hpp"
#include "experiments/cluster/slurm.hpp"

#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// How far a shard is.
struct ShardStatus {
  int shard = 1;
  std::size_t runs = 0, done = 0, failed = 0;  ///< done: whose record the folder has, failed ones aside
  bool at_work = false;                        ///< a process of this machine has its file, or a task of Slurm runs
  std::size_t begun = 0;               ///< that its task says it has done, which are put into the folder at its end
  std::optional<SlurmTask> task = {};  ///< that Slurm knows of

  std::size_t left() const { return runs - done - failed; }
};

/// How far the campaign of a folder is.
struct CampaignStatus {
  std::string folder, campaign, state;  ///< manifest's: running, finished ...
  std::size_t runs = 0, done = 0, failed = 0, left = 0;
  std::vector<ShardStatus> shards;
  double core_s_left = 0.0;  ///< by what runs of the same variant took, or where there is none by order of magnitude
  int cores = 0;             ///< at work
  std::optional<double> seconds_left;  ///< with as many cores; none at work: none
  std::uint64_t bytes = 0;
  std::vector<std::string>
      problems;  ///< a line each: damage, records that do not count, a cluster that does not answer
};

/// Reads the folder and, if jobs were submitted for it, asks Slurm. Throws ConfigError if it is no folder of a campaign.
CampaignStatus status_of(const std::string& folder);

/// For a person and as JSON: shards that are whole are counted, not listed.
Result result_of(const CampaignStatus& status);

}  // namespace solenoid
