#pragma once

#include "experiments/report/results.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// What merge() put together.
struct Merged {
  Results results;
  std::size_t ok = 0, unstable = 0, failed = 0, missing = 0;
  std::vector<std::string> problems = {};  ///< what is damaged or does not count, a line each
  std::string report = {};                 ///< the page's file, or none
  std::string no_report = {};              ///< why there is none

  bool whole() const { return failed == 0 && missing == 0; }
};

/// Makes of the shards in a folder what a campaign that was not parted leaves there: runs.csv, the last manifest and, if
/// it is wanted, report.html; equal to those to the last byte, times aside. Shards may be missing, half done, cut off or
/// there twice: each run counts once. `baseline`: of --against; that it has runs to compare is required before anything is
/// written. Throws ConfigError for it, or if the folder is no campaign's of this version, OutputError.
Merged merge(const std::string& folder, bool with_report, const std::string& baseline = "");

}  // namespace solenoid
