#pragma once

#include "core/mpc/mode_set.hpp"
#include "core/system/description.hpp"

#include <string>

namespace solenoid {

/// In words: "position 0.1002 m beyond its bound of 0.1 m, 13 ms ahead"; empty for a plan that keeps to its limits.
/// `tick_s`: of a step.
std::string broken_limit_text(const BrokenLimit& broken, const SystemDescription& system, const ModeSet& modes,
                              double tick_s);

}  // namespace solenoid
