#include "controllers/compiled_solvers.ipp"

#include "controllers/compiled_relaxed.ipp"
#include "core/systems/thrusters/free_flyer.hpp"

namespace solenoid {

SOLENOID_COMPILE_SOLVERS(FreeFlyer)
SOLENOID_COMPILE_SQP(FreeFlyer)
SOLENOID_COMPILE_IPOPT(FreeFlyer)

}  // namespace solenoid
