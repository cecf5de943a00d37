#pragma once

#include <cmath>
#include <limits>

namespace solenoid {

/// Costs of one plan by different code, and proofs, hold to rounding: this much, relative, is no difference.
inline constexpr double cost_rounding = 1e-12;

/// How far a cost is above an optimum or a bound, relative to it; negative below. 0 within rounding, at a bound of 0
/// else infinite.
inline double gap_above(double cost, double bound) {
  const double above = cost - bound;
  if (std::abs(above) <= cost_rounding * bound) return 0.0;
  return bound > 0.0 ? above / bound : std::numeric_limits<double>::infinity();
}

}  // namespace solenoid
