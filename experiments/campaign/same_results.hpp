#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace solenoid {

/// How many runs of one results folder were compared with another's, and in what they differ.
struct SameResults {
  std::int64_t records = 0, traces = 0;
  std::vector<std::string> differences;
};

/// Compares each run of `expected` with that in `found`: equal to the last digit but for the times of solving. Runs that
/// are missing or have failed, and traces that are damaged, are differences if `whole`: a campaign that was cut off does
/// them when it is resumed. Both are of one campaign and program. A folder without a campaign expects nothing.
SameResults compare_results_folders(const std::string& expected, const std::string& found, bool whole);

}  // namespace solenoid
