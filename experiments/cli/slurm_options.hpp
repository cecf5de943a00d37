#pragma once

#include "experiments/cluster/slurm.hpp"

#include <string>

namespace CLI {
class App;
}

namespace solenoid {

/// Whether and how a command has its runs done on a cluster.
struct SlurmOptions {
  bool wanted = false, dry_run = false;
  SlurmSettings settings;

  /// Throws ConfigError for an option that says how without --slurm.
  void require_slurm(const CLI::App& command) const;
};

/// --slurm, --partition, --time, --mem, --nodes, --throttle, --sbatch and, if it can be shown first, --dry-run.
void add_slurm_options(CLI::App& command, SlurmOptions& options, bool with_dry_run);

/// Submits what of a campaign is missing in its folder, or prints the scripts in place of that; the exit code. What is
/// said goes to standard error, the folder and jobs to standard output.
int submit_campaign(const Campaign& campaign, const std::string& folder, const SlurmOptions& options);

}  // namespace solenoid
