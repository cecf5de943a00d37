#include "controllers/compiled_relaxed.ipp"
#include "controllers/compiled_solvers.ipp"
#include "controllers/systems/actuator/models.hpp"

namespace solenoid {

SOLENOID_COMPILE_SOLVERS(ResidualActuator)
SOLENOID_COMPILE_SQP(ResidualActuator)

}  // namespace solenoid
