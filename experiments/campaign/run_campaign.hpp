#pragma once

#include "experiments/campaign/run_record.hpp"

#include <optional>
#include <string>
#include <vector>

namespace solenoid {

struct CampaignOptions {
  std::string out;              ///< results folder; empty: results/NAME-DATE-TIME below the current folder
  int jobs = 0;                 ///< worker processes; 0: one a core
  double tick_limit_s = 600.0;  ///< a run one of whose ticks takes longer is stuck, and fails; 0: none does
  bool progress = true;         ///< said on standard error
};

struct CampaignResult {
  std::vector<RunRecord> records;  ///< in canonical order; without those that an interrupt left undone
  std::string folder;
  bool interrupted = false;
};

/// results/NAME-DATE-TIME below the current folder, not there yet.
std::string new_results_folder(const std::string& name);

/// Runs a campaign into its results folder: each run in a process of its own, those already there under the same
/// configuration taken as they are. Ctrl-C ends the workers and keeps what is finished. The same campaign gives the
/// same records to the last bit whatever the jobs, solver times aside. Throws OutputError when the folder cannot be
/// written.
CampaignResult run_campaign(const Campaign& campaign, const CampaignOptions& options);

/// The records of a campaign's runs in canonical order, nothing kept on disk and nothing said; nothing if interrupted.
/// jobs 0: one a core.
std::optional<std::vector<RunRecord>> run_in_processes(const Campaign& campaign, int jobs, double tick_limit_s = 600.0);

}  // namespace solenoid
