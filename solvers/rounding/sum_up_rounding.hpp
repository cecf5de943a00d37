#pragma once

#include "core/mpc/plan.hpp"
#include "solvers/rounding/mode_weights.hpp"
#include "solvers/rounding/switch_limits.hpp"

namespace solenoid {

/// How far a rounding of M modes on this grid can be from its weights at most, if sum-up rounding made it:
///
///     max_k dt[k] * (1/2 + 1/3 + ... + 1/M)                                              [theory-rounding.md, eq. 3]
///
/// The best possible constant (Kirches, Lenders, Manns 2020, on equal intervals; here proven for ragged ones too).
double sum_up_rounding_guarantee(const ModeWeights& weights) noexcept;

/// How near a rounding came to its weights.
struct SumUpReport {
  Status status = Status::numerical_failure;  ///< feasible; numerical_failure: not normalised weights, modes untouched
  double gap = 0.0;                           ///< integral_gap of the modes chosen
  double guarantee = 0.0;                     ///< what the theory allows: gap <= guarantee, up to rounding
};

/// Sum-up rounding with the special-ordered-set condition (Sager, Bock, Diehl 2012).
///
/// in each interval the mode that is owed most time once the interval's share has been added:
///     modes[k] = argmax_m  sum_{l<=k} a[l][m] dt[l] - sum_{l<k} [modes[l] = m] dt[l]       [theory-rounding.md, eq. 2]
/// ties     the mode of the lowest number
/// shapes   modes: K    owed: scratch, at least one entry a mode
/// promise  no allocation
SumUpReport sum_up_rounding(const ModeWeights& weights, std::span<int> modes, std::span<double> owed) noexcept;

/// The same where switches change one at a time: in each interval the mode that is owed most among those that may follow
/// the one before, by limits.one_at_a_time and from limits.in_force on; other limits are not looked at. (Dwell times
/// enter sum-up rounding in the same way: Zeile, Robuschi, Sager 2021.) The guarantee is then that of the rounding
/// without groups, and may be missed. numerical_failure too where no mode may follow.
SumUpReport sum_up_rounding(const ModeWeights& weights, const SwitchLimits& limits, std::span<int> modes,
                            std::span<double> owed) noexcept;

/// The first with its own scratch; allocates.
SumUpReport sum_up_rounding(const ModeWeights& weights, std::vector<int>& modes);

}  // namespace solenoid
