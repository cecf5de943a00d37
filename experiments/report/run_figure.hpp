#pragma once

#include "experiments/base/plot.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/campaign/trace.hpp"

#include <cstdint>
#include <string>

namespace solenoid {

/// The plots of a run's system (TraceLayout) over one time axis, 1280 pixels wide, 160 high each: of plots that share a
/// place the first. Drawn by gnuplot from the lowest and highest value of each of some hundred spans of time, so a file
/// stays small whatever the run's length and no peak is lost.
///
/// `path` is written whole or not at all. Throws OutputError if it cannot be written, ConfigError if gnuplot is not
/// installed.
void draw_figure(const Trace& trace, const std::string& title, const std::string& path, FigureFormat format);

/// "VARIANT | SCENARIO, seed 1 | RMSE 0.280 mm, ...": the metrics that say how far a run was off, first the judged one.
std::string figure_title(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                         const Metrics& metrics);

/// Draws a run that was simulated.
void draw_figure(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                 const RunResult& result, const std::string& path, FigureFormat format);

/// Simulates the run and draws it.
void draw_figure(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                 const std::string& path, FigureFormat format);

}  // namespace solenoid
