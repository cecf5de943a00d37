#pragma once

#include "experiments/study/scaling.hpp"

namespace solenoid {

/// The horizon of 100 ms in `count` blocks (1 to 8): short ones first, where the next command is decided, about twice
/// as long from one to the next.
std::vector<int> scaling_blocks(int count);

/// The study for the actuator, on the thesis's motions: one horizon whatever the number of blocks, and of its valve sets
/// three. `cylinder`: the cylinder alone; else with the motor's law in the prediction.
std::vector<ScalingRow> study_actuator_scaling(const ScalingOptions& options, bool cylinder,
                                               const std::function<void(const std::string&)>& progress,
                                               const std::function<bool()>& stop);

}  // namespace solenoid
