#pragma once

#include "core/metrics/metrics.hpp"

#include <cstdint>
#include <vector>

namespace solenoid {

/// The percentiles of however many values in memory that does not grow: each within `accuracy` of the nearest-rank one,
/// relatively, the greatest exact. Values are counted in buckets whose bounds are powers of (1 + a) / (1 - a), by C.
/// Masson, J. E. Rim and H. K. Lee, "DDSketch: a fast and fully-mergeable quantile sketch with relative-error
/// guarantees", VLDB 2019. Below `least` a value is 0 (of times in microseconds: a picosecond), beyond 1e12 it is 1e12.
class PercentileSketch {
 public:
  static constexpr double accuracy = 0.001, least = 1e-6;

  PercentileSketch();
  /// Allocates nothing. What is not a number is not counted.
  void add(double value) noexcept;
  Percentiles percentiles() const;

 private:
  double at(double share) const;
  std::vector<std::int64_t> counts_;
  std::int64_t values_ = 0;
  double max_ = 0.0;
};

}  // namespace solenoid
