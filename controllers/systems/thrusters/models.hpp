#pragma once

#include "controllers/model_list.hpp"
#include "core/systems/thrusters/free_flyer.hpp"

namespace solenoid {

/// Models of the thrusters.
using thrusters_models = ModelList<FreeFlyer>;

}  // namespace solenoid
