#include "controllers/compiled_relaxed.ipp"
#include "controllers/systems/actuator/models.hpp"

namespace solenoid {

SOLENOID_COMPILE_IPOPT(PneumaticActuator)
SOLENOID_COMPILE_IPOPT(PrestabilisedActuator)

}  // namespace solenoid
