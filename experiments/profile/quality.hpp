#pragma once

#include "experiments/base/plot.hpp"
#include "experiments/campaign/campaign.hpp"

#include <functional>

namespace solenoid {

/// A variant's closed loops with every solve cut at a budget.
struct QualityPoint {
  std::string variant;
  double budget_ms = 0.0;
  double error = 0.0;            ///< geometric mean of the system's judged metric over scenarios and seeds
  double proven_fraction = 0.0;  ///< of the solves, mean over runs
  double late_fraction = 0.0;    ///< of the solves: ended more than 50 us after the budget
  int unstable = 0;              ///< runs that ended with a state that is no number; not in the error
};

/// Runs the campaign's variants with each budget, one run after the other on one core (as of PinnedCore). A deadline is
/// wall time: what else the machine does at the time shows.
std::vector<QualityPoint> quality_against_time(const Campaign& campaign, const std::vector<double>& budgets_ms,
                                               int core, const std::function<bool()>& interrupted);

/// Error and share proven optimal against the budget, a line a variant.
Plot quality_plot(const std::vector<QualityPoint>& points, const std::string& error_heading);

}  // namespace solenoid
