#pragma once

#include "controllers/model_list.hpp"
#include "core/systems/actuator/prestabilised.hpp"

#include <concepts>

namespace solenoid {

/// Models of the actuator: without and with the motor's law in the prediction.
using actuator_models = ModelList<PneumaticActuator, PrestabilisedActuator>;

/// One of these, for what is made for them alone.
template <class M>
concept ActuatorModel = HybridModel<M> && std::derived_from<M, PneumaticActuator>;

}  // namespace solenoid
