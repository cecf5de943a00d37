#include "controllers/compiled_relaxed.ipp"
#include "controllers/systems/actuator/models.hpp"

namespace solenoid {

SOLENOID_COMPILE_SQP(PneumaticActuator)
SOLENOID_COMPILE_SQP(PrestabilisedActuator)

}  // namespace solenoid
