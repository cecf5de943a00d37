#pragma once

#include "experiments/campaign/run_record.hpp"

#include <span>
#include <string>

namespace solenoid {

/// A campaign's result for a person: the ranked summary and, with `details`, every run below its scenario.
std::string comparison_text(std::span<const RunRecord> records, bool details, bool colour);

/// `{"runs": [...]}`.
std::string comparison_json(std::span<const RunRecord> records);

}  // namespace solenoid
