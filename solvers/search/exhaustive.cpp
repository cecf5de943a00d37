#include "solvers/search/exhaustive.hpp"

#include "core/systems/actuator/dynamics.hpp"

// The library's own system, compiled once; other models instantiate the template where they use it.
template class solenoid::Exhaustive<solenoid::PneumaticActuator>;
