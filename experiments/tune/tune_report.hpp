#pragma once

#include "experiments/tune/tune.hpp"

#include <string>

namespace solenoid {

struct Result;

/// Before and after on training and held-out scenarios, and the values found; drawn is the objective against the step.
Result result_of(const TuneSettings& settings, const TuneResult& result);

/// Draws the objective against the step into history.svg of the run's folder; without gnuplot it is left out, since a
/// picture is no reason to lose what was found. Returns why, if it is not there.
std::string draw_history(const TuneResult& result);

/// The last step in a line.
std::string tune_progress(const TuneSettings& settings, const TuneResult& result);

}  // namespace solenoid
