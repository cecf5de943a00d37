#pragma once

#include "experiments/base/plot.hpp"
#include "experiments/campaign/simulate.hpp"

#include <cstdint>
#include <string>

namespace solenoid {

/// The five plots of the thesis's figures 6-3 to 7-9 over one time axis, 1280 x 800: desired and actual position [mm],
/// error [mm], valve mode, cylinder force [N], motor force [N]. Position, error and forces are the true ones. Drawn by
/// gnuplot from the lowest and highest value of each of some hundred spans of time, so a file stays small whatever the
/// run's length and no peak is lost.
///
/// `path` is written whole or not at all. Throws OutputError if it cannot be written, ConfigError if gnuplot is not
/// installed.
void draw_figure(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                 const RunResult& result, const std::string& path, FigureFormat format);

/// Simulates the run and draws it.
void draw_figure(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                 const std::string& path, FigureFormat format);

}  // namespace solenoid
