#pragma once

#include "experiments/tune/tune.hpp"

#include <string>

namespace solenoid {

/// Before and after on training and held-out scenarios, and the values found.
std::string tune_text(const TuneSettings& settings, const TuneResult& result, bool colour);
std::string tune_json(const TuneSettings& settings, const TuneResult& result);

/// The last step in a line.
std::string tune_progress(const TuneSettings& settings, const TuneResult& result);

/// Draws objective against step, the training's with its best so far, the held-out's and what was chosen, into a file
/// ending in .svg or .png. Throws ConfigError if gnuplot is missing, OutputError if the file cannot be written.
void draw_tuning(const TuneResult& result, const std::string& path);

}  // namespace solenoid
