#pragma once

#include "experiments/campaign/campaign.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// A campaign's scenarios to teach on and those to judge on, with one variant's teacher.
struct SplitCampaign {
  Campaign training, held_out;
  std::vector<std::string> training_names, held_out_names;
};

/// Scenarios named held_out... judge. Throws ConfigError where either kind is missing, the variant plans nothing, or
/// branch and bound does not solve its problems.
SplitCampaign split_campaign(const std::string& campaign, const std::string& variant);

}  // namespace solenoid
