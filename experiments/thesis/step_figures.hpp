#pragma once

#include "core/reference/trajectory.hpp"
#include "core/rt/recorder.hpp"

#include <span>

namespace solenoid {

/// Which position a step test is judged by: the true one, or the one a test on hardware can show, measured and through
/// the 50 Hz Butterworth filter of section 3.5 (model.md, E13).
enum class PositionSignal { truth, filtered };

/// What Tables 5-2 to 5-4 state of a step. With e = y_d - y over the steady part, from trajectory.steady_from_s() on:
struct StepFigures {
  double overshoot_percent = 0;  ///< (max y - mean steady y) / (mean steady y - start), at least 0
  double max_abs_error_mm = 0;   ///< max |e|
  double mean_abs_error_mm = 0;  ///< mean |e|
  double abs_mean_error_mm = 0;  ///< |mean e|
};

/// The trajectory ends in a dwell away from its start.
StepFigures step_figures(std::span<const TickRecord> ticks, const Trajectory& trajectory, PositionSignal signal);

}  // namespace solenoid
