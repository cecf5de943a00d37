#pragma once

#include "experiments/campaign/run_record.hpp"

#include <span>
#include <string>

namespace solenoid {

/// Draws each ranked variant as a point, RMSE against coil switches a second and RMSE against supply air, with the
/// fronts no variant is better than in both. `path` ends in .svg or .png. Throws ConfigError for another ending or
/// without gnuplot.
void draw_pareto(std::span<const RunRecord> records, const std::string& path);

}  // namespace solenoid
