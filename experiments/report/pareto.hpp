#pragma once

#include "experiments/report/ranking.hpp"

#include <span>
#include <string>

namespace solenoid {

/// Draws each ranked variant as a point, its error against each of the system's efforts, a panel each, with the fronts
/// no variant is better than in both. `path` ends in .svg or .png. Throws ConfigError for another ending, without gnuplot,
/// and where there is nothing to draw.
void draw_ranked(Ranking ranking, const std::string& path);
/// The same of records, ranked over all of them.
void draw_pareto(std::span<const RunRecord> records, const std::string& path);

}  // namespace solenoid
