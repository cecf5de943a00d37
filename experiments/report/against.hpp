#pragma once

#include "experiments/base/table.hpp"
#include "experiments/campaign/run_record.hpp"

#include <optional>
#include <span>
#include <string>

namespace solenoid {

/// Variants against one of them, run by run: the ratio of the judged errors in each scenario and seed that both ended
/// well, its geometric mean with the normal 95 % interval, and how often a variant was better. `baseline` empty: the
/// best ranked. Nothing where there is no other variant, or no run in common. Throws ConfigError for a name without runs.
std::optional<Table> against(std::span<const RunRecord> records, const std::string& baseline);

}  // namespace solenoid
