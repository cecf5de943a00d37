#pragma once

#include "core/mpc/mode_set.hpp"
#include "core/systems/inverter/inverter.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// The inverters by name: three_level, two_level.
const std::vector<std::string>& inverter_configurations();

/// The mode set of an inverter for InverterLoad; a mode's name gives the levels of phases a, b, c, such as "+0-".
///
///     three_level   neutral-point clamped: two gate signals a phase, level = lower + upper - 1, 27 modes. The pattern
///                   upper on, lower off does not exist, and of a phase's two signals one changes at a time, so that a
///                   phase goes from + to - by way of 0 (|u[k] - u[k-1]|_inf <= 1, usual with such inverters). So the
///                   switch changes of a command are |u[k] - u[k-1]|_1 = |u[k] - u[k-1]|_2^2.
///     two_level     one gate signal a phase, level = 2 signal - 1, 8 modes
///
/// Mode 0 of three_level is "000", which may follow every mode and is the safe one, as "---" is of two_level: zero voltage,
/// an active short circuit, whose current is for the machine to bear or for a contactor to break. Switches are numbered phase by phase, lower first.
/// Throws std::invalid_argument for another name.
ModeSet inverter_modes(const std::string& configuration, const InverterParameters& parameters = {});

}  // namespace solenoid
