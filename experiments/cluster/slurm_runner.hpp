#pragma once

#include "experiments/campaign/run_campaign.hpp"
#include "experiments/cluster/slurm.hpp"

#include <string>

namespace solenoid {

/// Does campaigns as arrays and waits for each, submitted again while tasks fail, at most three times. Each has a folder of
/// its own below `folder`, which is removed once its records are read. The runner returns nothing if it is interrupted, in
/// which case its jobs are cancelled, and throws std::runtime_error naming the folder if runs are missing in the end.
CampaignRunner slurm_runner(const std::string& folder, SlurmSettings settings);

}  // namespace solenoid
