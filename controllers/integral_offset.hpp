#pragma once

#include <algorithm>
#include <limits>

namespace solenoid {

/// Integral action as an offset of the reference of the switches, (5.9), with a forgetting factor and a bound against wind-up:
///
///     sum <- forgetting * sum + (y_d - y),   y_offset = gain * sum,   |y_offset| <= limit        once a T_s
///
/// gain 0.005, forgetting 1 and no limit give DMPC+I exactly.
struct IntegralSettings {
  double gain = 0.0;
  double forgetting = 1.0;
  double limit_m = std::numeric_limits<double>::infinity();
  bool operator==(const IntegralSettings&) const = default;
};

/// The sum of IntegralSettings, a step a control period.
class IntegralOffset {
 public:
  IntegralOffset() = default;
  explicit IntegralOffset(const IntegralSettings& settings) : settings_(settings) {}

  /// Adds y_d - y and returns y_offset [m].
  double update(double error_m) {
    if (settings_.gain == 0.0) return 0.0;
    const double most = settings_.limit_m / settings_.gain;
    sum_ = std::clamp(settings_.forgetting * sum_ + error_m, -most, most);
    return settings_.gain * sum_;
  }

 private:
  IntegralSettings settings_;
  double sum_ = 0.0;
};

}  // namespace solenoid
