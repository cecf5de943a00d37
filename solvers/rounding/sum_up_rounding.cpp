#include "solvers/rounding/sum_up_rounding.hpp"

#include <algorithm>

namespace solenoid {

double sum_up_rounding_guarantee(const ModeWeights& weights) noexcept {
  double harmonic = 0.0;
  for (int m = 2; m <= weights.modes; ++m) harmonic += 1.0 / m;
  return harmonic * weights.longest();
}

namespace {

/// may_follow(before, m): whether mode m may follow mode `before`, -1 for what is in force.
template <class MayFollow>
SumUpReport round_up(const ModeWeights& weights, std::span<int> modes, std::span<double> owed,
                     MayFollow may_follow) noexcept {
  if (weights.modes < 1 || !is_normalised(weights)) return {};
  owed = owed.first(static_cast<std::size_t>(weights.modes));
  std::fill(owed.begin(), owed.end(), 0.0);
  int before = -1;
  for (std::size_t k = 0; k < weights.intervals(); ++k) {
    int most = -1;
    for (int m = 0; m < weights.modes; ++m) {
      const auto at = static_cast<std::size_t>(m);
      owed[at] += weights.dt[k] * weights.at(k, at);
      if ((most < 0 || owed[at] > owed[static_cast<std::size_t>(most)]) && may_follow(before, m)) most = m;
    }
    if (most < 0) return {};
    owed[static_cast<std::size_t>(most)] -= weights.dt[k];
    modes[k] = before = most;
  }
  return {Status::feasible, integral_gap(weights, modes), sum_up_rounding_guarantee(weights)};
}

}  // namespace

SumUpReport sum_up_rounding(const ModeWeights& weights, std::span<int> modes, std::span<double> owed) noexcept {
  return round_up(weights, modes, owed, [](int, int) { return true; });
}

SumUpReport sum_up_rounding(const ModeWeights& weights, const SwitchLimits& limits, std::span<int> modes,
                            std::span<double> owed) noexcept {
  return round_up(weights, modes, owed, [&](int before, int mode) {
    const std::int64_t from = before < 0 ? limits.in_force : limits.patterns[static_cast<std::size_t>(before)];
    const SwitchPattern to = limits.patterns[static_cast<std::size_t>(mode)];
    return from < 0 || one_at_a_time(static_cast<SwitchPattern>(from) ^ to, limits.one_at_a_time);
  });
}

SumUpReport sum_up_rounding(const ModeWeights& weights, std::vector<int>& modes) {
  std::vector<double> owed(static_cast<std::size_t>(std::max(weights.modes, 0)));
  modes.resize(weights.intervals());
  return sum_up_rounding(weights, modes, owed);
}

}  // namespace solenoid
