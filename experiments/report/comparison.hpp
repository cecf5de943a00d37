#pragma once

#include "experiments/base/result.hpp"
#include "experiments/report/run_table.hpp"

#include <span>
#include <string>

namespace solenoid {

/// A campaign's result: the ranked summary and, with `details`, every run below its scenario, each system by itself.
/// What is in the columns is the system's description's. Where there are several variants, their paired comparison with
/// `baseline`, the best ranked if it is empty: a table unless all have one task alone and no baseline is named, and
/// data in any case. JSON: `{"runs": [...], "paired": [...]}`, an object a system with its name and what Against::json
/// has; CSV: this comparison where a baseline is named; of the runs it is to_csv's. Throws ConfigError for a baseline
/// without runs.
Result result_of(std::span<const RunRecord> records, bool details, const std::string& baseline = "");
/// The same of as many runs as one likes: without their list, which JSON would have.
Result result_of(const RunTable& runs, const std::string& baseline = "");

/// Refuses a baseline, before work that may take hours, that is none of the variants, or where there is no other.
/// `option`: what it is said with. Throws ConfigError; of an empty one nothing.
void require_baseline(std::span<const std::string> variants, const std::string& baseline, const std::string& option);

/// The runs alone: `{"runs": [...]}`.
std::string runs_json(std::span<const RunRecord> records);

/// A sentence with the variants that cannot run on hardware; nothing if all can.
std::string real_time_note(std::span<const VariantConfig> variants);

}  // namespace solenoid
