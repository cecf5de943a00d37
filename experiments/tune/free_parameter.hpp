#pragma once

#include <string>

namespace solenoid {

/// A key of a variant's table that a tuning run may set, and the range it searches: as a point of [0, 1], even in the
/// value or in its logarithm.
struct FreeParameter {
  enum class Scale { linear, logarithmic, whole };
  std::string key;  ///< below [variant.NAME]: "cost.switching", "horizon.steps"
  double low = 0.0, high = 1.0;
  Scale scale = Scale::linear;

  /// The value at a point of [0, 1]; beyond, the nearest end's. Whole numbers are rounded to.
  double at(double point) const;
  /// The inverse, in [0, 1].
  double point(double value) const;
};

/// Reads `KEY=LOW..HIGH`, followed by `:log` or `:whole` or nothing. Throws ConfigError naming what is allowed.
FreeParameter parse_free_parameter(const std::string& text);

}  // namespace solenoid
