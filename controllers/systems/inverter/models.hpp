#pragma once

#include "controllers/model_list.hpp"
#include "core/systems/inverter/inverter.hpp"

namespace solenoid {

/// Models of the inverter.
using inverter_models = ModelList<InverterLoad>;

}  // namespace solenoid
