#pragma once

#include "experiments/base/plot.hpp"
#include "experiments/report/ranking.hpp"
#include "experiments/report/task_errors.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// A variant's errors, each divided by the least that any variant has in the same task. The share of `runs` with a
/// ratio of at most tau is the performance profile rho(tau) of E. D. Dolan and J. J. More (Benchmarking optimization
/// software with performance profiles, Mathematical Programming 91, 2002): rho(1) is how often the variant is the best,
/// ties with it, and what is missing to 1 at the far end how often it did not end well.
struct PerformanceProfile {
  std::size_t ok = 0, runs = 0;  ///< tasks that it ended well; all tasks that any variant ran
  std::vector<double> ratios;    ///< at least 1, increasing: all of `ok`, or as many of them as quantiles() leaves
};

/// Of each variant of the table.
std::vector<PerformanceProfile> performance_profiles(const TaskErrors& errors, std::size_t most);

/// Draws the profiles of all runs, tau on a logarithmic axis to base 2, best ranked first, into `path`. Throws
/// ConfigError without gnuplot and where no run ended well.
void draw_profiles(const RunTable& runs, const std::string& path, FigureFormat format);

}  // namespace solenoid
