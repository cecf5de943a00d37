#pragma once

#include "experiments/campaign/shards.hpp"
#include "experiments/campaign/stored_runs.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// Of which runs every tick is kept (trace.hpp).
struct TraceKeeping {
  enum class Which { all, none, worst } which = Which::all;
  std::size_t worst =
      0;  ///< so many of each variant, of those that a process does: the largest errors, unstable ones first

  /// Reads "all", "none" or "worst:20". Throws ConfigError.
  static TraceKeeping of(const std::string& text);
};

struct CampaignOptions {
  std::string out;              ///< results folder; empty: results/NAME-DATE-TIME below the current folder
  int jobs = 0;                 ///< worker processes; 0: one a core
  double tick_limit_s = 600.0;  ///< a run one of whose ticks takes longer is stuck, and fails; 0: none does
  bool progress = true;         ///< said on standard error
  Shard shard{};                ///< what of it is done
  std::string scratch{};  ///< a shard's files grow in a folder here and are put into `out` at the end; empty: in `out`
  TraceKeeping traces{};
};

struct CampaignResult {
  std::string folder;
  bool interrupted = false;
  std::size_t runs = 0, ended = 0,
              failed = 0;                  ///< of the campaign or the shard; those that ended, failed ones among them
  std::size_t done = 0;                    ///< of those now
  double wall_s = 0.0;                     ///< in which they were
  std::shared_ptr<const StoredRuns> kept;  ///< of the whole campaign, which has to outlive it; null for a shard

  /// In canonical order, without those that an interrupt left undone.
  std::vector<RunRecord> records() const;
};

/// What does a campaign's runs and returns their records in canonical order; nothing if interrupted.
using CampaignRunner = std::function<std::optional<std::vector<RunRecord>>(const Campaign& campaign)>;

/// results/NAME-DATE-TIME below the current folder, not there yet.
std::string new_results_folder(const std::string& name);

/// Runs a campaign, or a shard of it, into its results folder: each run in a process of its own, those already there under
/// the same configuration taken as they are. Ctrl-C ends the workers and keeps what is finished. The same campaign gives
/// the same records to the last bit whatever the jobs and shards, solver times aside. Throws OutputError when the folder
/// cannot be written, ConfigError when a shard's folder is another's.
CampaignResult run_campaign(const Campaign& campaign, const CampaignOptions& options);

/// The records of a campaign's runs in canonical order, nothing kept on disk and nothing said; nothing if interrupted.
/// jobs 0: one a core.
std::optional<std::vector<RunRecord>> run_in_processes(const Campaign& campaign, int jobs, double tick_limit_s = 600.0);

}  // namespace solenoid
