#pragma once

#include "core/mpc/mode_set.hpp"
#include "core/systems/actuator/dynamics.hpp"

namespace solenoid {

/// A plant reports this at a tick.
struct Sensors {
  double time_s = 0.0;
  double position_m = 0.0;
  double pressure_a_pa = 0.0, pressure_b_pa = 0.0;
  /// The plant's own state, known only in simulation: recorded, and read by controllers only under ideal sensing.
  ActuatorState truth{};
  bool ideal = false;
  int stale_ticks = 0;         ///< age of these values in ticks: 0 when they were measured for this one
  bool node_was_safe = false;  ///< the I/O went to its safe state by itself since the last tick
};

/// A plant is told this: which coils are on, and the motor's force.
struct Command {
  SwitchPattern coils = 0;
  double motor_force_n = 0.0;

  bool operator==(const Command&) const = default;
};

/// A plant is the rig, its emulator or a simulation of it.
class Plant {
 public:
  virtual ~Plant() = default;
  /// Returns the sensors' values at `time_s`, which never decreases.
  virtual Sensors read(double time_s) noexcept = 0;
  /// Gives a command, which holds until the next one.
  virtual void write(const Command& command) noexcept = 0;
};

}  // namespace solenoid
