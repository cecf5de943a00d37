#pragma once

#include "core/rt/recorder.hpp"
#include "core/system/description.hpp"

#include <array>
#include <span>

namespace solenoid {

/// How an axis was followed: its true value against the desired one, in the axis's unit.
struct AxisErrors {
  double rms = 0, largest = 0;
};

/// What of a run the metrics of most systems are made of.
struct TrackingFigures {
  std::array<AxisErrors, max_axes> axis{};
  int switches = 0;       ///< changes of a switch
  double duration_s = 0;  ///< of the ticks
  bool finite = true;     ///< every true state that the system has was
};

/// Figures of a run whose switches stood at `start` before it; zeros for none.
TrackingFigures tracking_figures(std::span<const TickRecord> ticks, const SystemDescription& system, double tick_s,
                                 SwitchPattern start = 0);

}  // namespace solenoid
