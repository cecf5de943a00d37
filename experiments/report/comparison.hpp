#pragma once

#include "experiments/base/result.hpp"
#include "experiments/report/run_table.hpp"

#include <span>

namespace solenoid {

/// A campaign's result: the ranked summary and, with `details`, every run below its scenario, each system by itself. What
/// is in the columns is the system's description's. JSON: `{"runs": [...]}`; CSV is to_csv's.
Result result_of(std::span<const RunRecord> records, bool details);
/// The same of as many runs as one likes: without their list, which JSON would have.
Result result_of(const RunTable& runs);

/// A sentence with the variants that cannot run on hardware; nothing if all can.
std::string real_time_note(std::span<const VariantConfig> variants);

}  // namespace solenoid
