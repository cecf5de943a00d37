#include "core/metrics/percentile_sketch.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {
namespace {

constexpr double greatest = 1e12;
const double ratio = (1 + PercentileSketch::accuracy) / (1 - PercentileSketch::accuracy);

/// 0 for what is too small; bucket k holds (least ratio^(k-1), least ratio^k].
std::size_t bucket_of(double value) noexcept {
  if (value <= PercentileSketch::least) return 0;
  return static_cast<std::size_t>(
      std::ceil(std::log(std::min(value, greatest) / PercentileSketch::least) / std::log(ratio)));
}

/// What is as far, relatively, from either end of the bucket.
double middle_of(std::size_t bucket) {
  if (bucket == 0) return 0.0;
  return PercentileSketch::least * std::pow(ratio, static_cast<double>(bucket)) * 2 / (ratio + 1);
}

}  // namespace

PercentileSketch::PercentileSketch() : counts_(bucket_of(greatest) + 1) {}

void PercentileSketch::add(double value) noexcept {
  if (std::isnan(value)) return;
  ++counts_[bucket_of(value)];
  max_ = values_ == 0 ? value : std::max(max_, value);
  ++values_;
}

Percentiles PercentileSketch::percentiles() const {
  if (values_ == 0) return {};
  return {at(0.5), at(0.9), at(0.99), at(0.999), max_};
}

double PercentileSketch::at(double share) const {
  const auto rank = static_cast<std::int64_t>(std::ceil(share * static_cast<double>(values_)));
  std::int64_t below = 0;
  for (std::size_t k = 0; k < counts_.size(); ++k)
    if ((below += counts_[k]) >= rank) return std::min(middle_of(k), max_);
  return max_;
}

}  // namespace solenoid
