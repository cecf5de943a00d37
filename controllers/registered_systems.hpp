#pragma once

/// The systems there are, in the order of listings; the first is what a file means that names none. A system NAME has
///
///   controllers/systems/NAME               const System& NAME_system()
///   experiments/systems/NAME               const SimulatedSystem& NAME_simulation()
///
/// and its name here.
#define SOLENOID_SYSTEMS(X) \
  X(actuator)               \
  X(thrusters)              \
  X(inverter)
