#pragma once

#include "controllers/instances/instance_set.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/rig/log/recorded_run.hpp"
#include "experiments/rig/replay_run.hpp"

namespace solenoid {

/// Runs every variant of a campaign on every scenario and seed, one solve after the other to its end whatever the
/// variant's deadline, and keeps about `per_variant` of its problems, spread evenly over runs and time. Same campaign,
/// same instances to the last bit. Interrupted, it has those of the runs before.
///
/// References are kept as windows of the scenario's motion at whole milliseconds, which differ from what the loop posed
/// by rounding; the plans recorded are those of the instances as kept.
InstanceSet record_instances(const Campaign& campaign, std::size_t per_variant, const Interrupted& interrupted = {});

/// The problems that these variants (shipped ones; none: the log's own) pose when the measurements of a run are put
/// through them: what replay_other does. Throws ConfigError for a log that does not say how it was made, or a variant
/// that is not known. Interrupted, it has the problems of before.
InstanceSet record_instances(const RecordedRun& run, const std::vector<std::string>& variants, std::size_t per_variant,
                             const Interrupted& interrupted = {});

/// A file of problems has the tables of its variants and no networks. Throws ConfigError, naming --record, for a
/// variant whose network is a file.
void require_carried(const Campaign& campaign);

}  // namespace solenoid
