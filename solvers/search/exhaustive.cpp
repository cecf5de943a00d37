#include "solvers/search/exhaustive.hpp"

#include "core/actuator/dynamics.hpp"

// The library's own system, compiled once; other models instantiate the template where they use it.
template class solenoid::Exhaustive<solenoid::PneumaticActuator>;
