#pragma once

#include <cmath>
#include <cstdint>

namespace solenoid {

/// Sampling of a system's controllers: estimators, input laws and model steps run once a tick T_s, predictive control
/// of the switches once a period T_sp of whole ticks.
struct Timing {
  double tick_s = 0.001;
  int ticks_per_period = 5;

  /// T_sp [s].
  constexpr double period_s() const { return tick_s * ticks_per_period; }
  /// The whole ticks nearest to a duration.
  std::int64_t ticks_in(double duration_s) const { return std::llround(duration_s / tick_s); }
  bool operator==(const Timing&) const = default;
};

}  // namespace solenoid
