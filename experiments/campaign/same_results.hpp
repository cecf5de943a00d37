#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

namespace solenoid {

/// How many files of one results folder were compared with another's, and in what they differ.
struct SameResults {
  std::int64_t records = 0, traces = 0;
  std::vector<std::string> differences;
};

/// Compares each run of `expected` with that in `found`: equal to the last digit but for the times of solving. Runs that
/// are missing or have failed are differences if `whole`: a campaign that was cut off does them when it is resumed.
/// `left_out`: names of files of runs.
SameResults compare_results_folders(const std::string& expected, const std::string& found, bool whole,
                                    const std::set<std::string>& left_out);

}  // namespace solenoid
