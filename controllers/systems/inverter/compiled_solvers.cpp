#include "controllers/compiled_solvers.ipp"

#include "controllers/compiled_relaxed.ipp"
#include "core/systems/inverter/inverter.hpp"

namespace solenoid {

SOLENOID_COMPILE_SOLVERS(InverterLoad)
SOLENOID_COMPILE_SQP(InverterLoad)
SOLENOID_COMPILE_IPOPT(InverterLoad)

}  // namespace solenoid
