#pragma once

#include "core/actuator/dynamics.hpp"
#include "core/mpc/mode_set.hpp"

namespace solenoid {

/// What a plant reports at a tick.
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

/// What a plant is told.
struct Command {
  SwitchPattern coils = 0;
  double motor_force_n = 0.0;

  bool operator==(const Command&) const = default;
};

/// The rig, its emulator or a simulation of it.
class Plant {
 public:
  virtual ~Plant() = default;
  /// Sensor values at `time_s`, which never decreases.
  virtual Sensors read(double time_s) noexcept = 0;
  /// Holds until the next write.
  virtual void write(const Command& command) noexcept = 0;
};

}  // namespace solenoid
