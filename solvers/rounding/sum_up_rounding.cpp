#include "solvers/rounding/sum_up_rounding.hpp"

#include <algorithm>

namespace solenoid {

double sum_up_rounding_guarantee(const ModeWeights& weights) noexcept {
  double harmonic = 0.0;
  for (int m = 2; m <= weights.modes; ++m) harmonic += 1.0 / m;
  return harmonic * weights.longest();
}

SumUpReport sum_up_rounding(const ModeWeights& weights, std::span<int> modes, std::span<double> owed) noexcept {
  if (weights.modes < 1 || !is_normalised(weights)) return {};
  owed = owed.first(static_cast<std::size_t>(weights.modes));
  std::fill(owed.begin(), owed.end(), 0.0);
  for (std::size_t k = 0; k < weights.intervals(); ++k) {
    for (std::size_t m = 0; m < owed.size(); ++m) owed[m] += weights.dt[k] * weights.at(k, m);
    const auto most = std::max_element(owed.begin(), owed.end());  // the first of equals
    *most -= weights.dt[k];
    modes[k] = static_cast<int>(most - owed.begin());
  }
  return {Status::feasible, integral_gap(weights, modes), sum_up_rounding_guarantee(weights)};
}

SumUpReport sum_up_rounding(const ModeWeights& weights, std::vector<int>& modes) {
  std::vector<double> owed(static_cast<std::size_t>(std::max(weights.modes, 0)));
  modes.resize(weights.intervals());
  return sum_up_rounding(weights, modes, owed);
}

}  // namespace solenoid
