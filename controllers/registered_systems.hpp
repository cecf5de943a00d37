#pragma once

#include "controllers/model_list.hpp"
#include "controllers/systems/actuator/models.hpp"
#include "controllers/systems/inverter/models.hpp"
#include "controllers/systems/thrusters/models.hpp"

/// The systems there are, in the order of listings; the first is what a file means that names none. A system NAME has
///
///   controllers/systems/NAME/models.hpp    NAME_models, the ModelList of what its controllers may believe
///   controllers/systems/NAME               const System& NAME_system()
///   experiments/systems/NAME               const SimulatedSystem& NAME_simulation()
///
/// and two lines here: the include and its name.
#define SOLENOID_SYSTEMS(X) \
  X(actuator)               \
  X(thrusters)              \
  X(inverter)

namespace solenoid {

#define SOLENOID_MODELS(name) name##_models,
/// The models of all of them.
using AllModels = JoinedModels<SOLENOID_SYSTEMS(SOLENOID_MODELS) ModelList<>>;
#undef SOLENOID_MODELS

}  // namespace solenoid
