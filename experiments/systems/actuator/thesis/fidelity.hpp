#pragma once

#include "experiments/systems/actuator/thesis/cases.hpp"

#include <span>

namespace solenoid {

/// What the nominal twin was chosen by, small is good: mean |ln(ours/thesis)| of the measured steady-state errors of
/// tables 5-2 to 5-4 plus the mean difference of Table 5-2's measured overshoots in units of 10 %.
double choice_criterion(std::span<const Cell> chapter5);
/// Largest measured overshoot of Table 5-2 from the given horizon on.
double largest_overshoot_percent(std::span<const Cell> cells, int from_np);

}  // namespace solenoid
