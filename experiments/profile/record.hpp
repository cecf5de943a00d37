#pragma once

#include "controllers/instances/instance_set.hpp"
#include "experiments/campaign/campaign.hpp"

namespace solenoid {

/// Runs every variant of a campaign on every scenario and seed, one solve after the other to its end whatever the
/// variant's deadline, and keeps about `per_variant` of its problems, spread evenly over runs and time. Same campaign,
/// same instances to the last bit.
///
/// References are kept as windows of the scenario's motion at whole milliseconds, which differ from what the loop posed
/// by rounding; the plans recorded are those of the instances as kept.
InstanceSet record_instances(const Campaign& campaign, std::size_t per_variant);

}  // namespace solenoid
