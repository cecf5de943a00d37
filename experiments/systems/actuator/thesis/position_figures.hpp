#pragma once

#include "core/reference/trajectory.hpp"
#include "core/rt/recorder.hpp"

#include <span>

namespace solenoid {

/// Which position a run is judged by: the true one, or the one a test on hardware can show, measured and through the
/// 50 Hz Butterworth filter of section 3.5 (model.md, E13).
enum class PositionSignal { truth, filtered };

/// What the tables of chapters 5 and 7 state of a run, e = y_d - y. The steady part is from trajectory.steady_from_s()
/// on; without one its figures are 0.
struct PositionFigures {
  double rmse_mm = 0, mae_mm = 0;  ///< root of the mean of e^2, max |e|
  double sse_max_abs_mm = 0;       ///< max |e| over the steady part, as chapter 5's tables say
  double sse_mean_abs_mm = 0;      ///< mean |e|, one reading of E11
  double sse_abs_mean_mm = 0;      ///< |mean e|, the other
  double ssa_mm = 0;               ///< max y - min y over the steady part
  double overshoot_percent = 0;    ///< of a step: (max y - mean steady y) / (mean steady y - start), at least 0
};

PositionFigures position_figures(std::span<const TickRecord> ticks, const Trajectory& trajectory,
                                 PositionSignal signal);

}  // namespace solenoid
