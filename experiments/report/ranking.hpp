#pragma once

#include "experiments/campaign/run_record.hpp"

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

/// A variant over the scenarios that all ranked variants finished.
struct RankedVariant {
  std::string variant;
  bool ranked = false;     ///< false: it finished no scenario in common with the others
  double rmse_mm = 0;      ///< geometric mean of the true RMSE over scenarios and seeds
  double rmse_margin = 1;  ///< its 95 % confidence interval is rmse_mm / margin to rmse_mm * margin
  double p95_rmse_mm = 0, worst_rmse_mm = 0;
  double switches_per_s = 0;               ///< mean
  double air_g = 0;                        ///< mean
  double solve_p50_us = 0;                 ///< median of the runs' medians
  double solve_p99_us = 0;                 ///< largest of the runs' 99th percentiles
  int runs = 0, failed = 0, unstable = 0;  ///< all runs of the variant
};

struct Ranking {
  std::vector<RankedVariant> variants;  ///< best first, those not ranked last
  std::size_t common_scenarios = 0, scenarios = 0;
};

/// Ranks by rmse_mm. A scenario counts for a variant when every one of its runs there ended well. The scenarios
/// compared are those that every ranked variant finished; a variant that finished fewer than half of what the best one
/// did is not ranked, and while nothing is common to all, the one with the fewest is left out.
Ranking rank_variants(std::span<const RunRecord> records);

}  // namespace solenoid
