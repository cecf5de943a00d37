#pragma once

#include "experiments/tune/tune.hpp"

#include <string>

namespace solenoid {

struct Result;

/// Before and after on training and held-out scenarios, and the values found; drawn is the objective against the step.
Result result_of(const TuneSettings& settings, const TuneResult& result);

/// The last step in a line.
std::string tune_progress(const TuneSettings& settings, const TuneResult& result);

}  // namespace solenoid
