#pragma once

#include "core/mpc/mode_set.hpp"
#include "core/systems/thrusters/free_flyer.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// Returns the modes of eight thrusters as data; switch c is thruster c of FreeFlyer.
///
/// `along_x`    coast, +x, -x: a translation on one axis of the body
/// `single`     coast and each thruster alone: each pushes and turns
/// `pairs`      coast, +x, -x, +y, -y by two thrusters side by side, +turn, -turn by two opposite ones: pure forces and
///              torques
/// `combined`   each of -x, 0, +x with each of -y, 0, +y and of -turn, 0, +turn: 27, by the fewest thrusters. Forces
///              are a pair's, but one thruster's along each axis where all three are asked for (the second of each pair
///              would turn against it); torques are a pair's
///
/// Delays are the parameters'. A Switch has one least time between changes, on or off: it is the greater of the two, so
/// that neither is undercut. Throws std::invalid_argument naming what is allowed.
ModeSet thruster_modes(const std::string& name, const FreeFlyerParameters& parameters);

/// Returns the names above.
const std::vector<std::string>& thruster_mode_sets();

}  // namespace solenoid
