#include "solvers/rounding/mode_weights.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {

double ModeWeights::longest() const noexcept { return dt.empty() ? 0.0 : *std::max_element(dt.begin(), dt.end()); }

bool normalise(ModeWeights& weights) noexcept {
  const auto modes = static_cast<std::size_t>(weights.modes);
  for (std::size_t k = 0; k < weights.intervals(); ++k) {
    double sum = 0.0;
    for (std::size_t m = 0; m < modes; ++m) {
      double& a = weights.at(k, m);
      if (a < 0.0) a = 0.0;
      sum += a;
    }
    if (!(sum > 0.0) || !std::isfinite(sum)) return false;
    for (std::size_t m = 0; m < modes; ++m) weights.at(k, m) /= sum;
  }
  return true;
}

bool is_normalised(const ModeWeights& weights) noexcept {
  for (std::size_t k = 0; k < weights.intervals(); ++k) {
    if (!(weights.dt[k] > 0.0) || !std::isfinite(weights.dt[k])) return false;
    double sum = 0.0;
    for (std::size_t m = 0; m < static_cast<std::size_t>(weights.modes); ++m) {
      if (!(weights.at(k, m) >= 0.0)) return false;
      sum += weights.at(k, m);
    }
    if (!(std::abs(sum - 1.0) <= 1e-9)) return false;
  }
  return true;
}

double integral_gap(const ModeWeights& weights, std::span<const int> modes) noexcept {
  double worst = 0.0;
  for (std::size_t m = 0; m < static_cast<std::size_t>(weights.modes); ++m) {
    double owed = 0.0;
    for (std::size_t k = 0; k < weights.intervals(); ++k) {
      owed += weights.dt[k] * (weights.at(k, m) - (modes[k] == static_cast<int>(m) ? 1.0 : 0.0));
      worst = std::max(worst, std::abs(owed));
    }
  }
  return worst;
}

}  // namespace solenoid
