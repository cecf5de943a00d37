#pragma once

#include "experiments/report/run_table.hpp"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace solenoid {

/// exp of the mean logarithm of positive numbers. Its normal 95 % interval is value / margin to value * margin.
struct GeometricMean {
  double value = 0, margin = 1;
};
GeometricMean geometric_mean(std::span<const double> values);

/// A variant over the scenarios that all ranked variants finished. Errors are the metric that the system is judged by,
/// in its unit.
struct RankedVariant {
  std::string variant;
  bool ranked = false;                     ///< false: it finished no scenario in common with the others
  double error = 0;                        ///< geometric mean over scenarios and seeds
  double margin = 1;                       ///< its 95 % confidence interval is error / margin to error * margin
  double p95 = 0, worst = 0;               ///< of the runs' errors
  std::vector<double> efforts;             ///< mean of each metric that is an effort, in the description's order
  double solve_p50_us = 0;                 ///< median of the runs' medians
  double solve_p99_us = 0;                 ///< largest of the runs' 99th percentiles
  int runs = 0, failed = 0, unstable = 0;  ///< all runs of the variant
};

struct Ranking {
  const SystemDescription* system = nullptr;  ///< whose variants they are
  std::vector<RankedVariant> variants;        ///< best first, those not ranked last
  std::size_t common_scenarios = 0, scenarios = 0;
};

/// Ranks by error. A scenario counts for a variant when every one of its runs there ended well. The scenarios
/// compared are those that every ranked variant finished; a variant that finished fewer than half of what the best one
/// did is not ranked, and while nothing is common to all, the one with the fewest is left out.
///
/// Over all runs of a table, or over those of one of its groups.
Ranking rank_variants(const RunTable& runs, std::optional<std::uint32_t> group = {});
/// Only variants of one system compare: the first record's. Records of others are left out (tables_of() parts them).
Ranking rank_variants(std::span<const RunRecord> records);

}  // namespace solenoid
