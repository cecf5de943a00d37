#include "controllers/compiled_solvers.ipp"
#include "controllers/systems/actuator/models.hpp"

namespace solenoid {

SOLENOID_COMPILE_SOLVERS(PneumaticActuator)
SOLENOID_COMPILE_SOLVERS(PrestabilisedActuator)

}  // namespace solenoid
