#pragma once

#include "core/mpc/mode_set.hpp"
#include "core/system/signals.hpp"

namespace solenoid {

/// A plant reports this at a tick.
struct Measurement {
  double time_s = 0.0;
  ChannelValues value{};  ///< of the system's channels; NaN: missing
  /// The plant's own state, known only in simulation: recorded, and read by controllers only under ideal sensing.
  StateValues truth{};
  bool ideal = false;
  int stale_ticks = 0;         ///< age of these values in ticks: 0 when they were measured for this one
  bool node_was_safe = false;  ///< the I/O went to its safe state by itself since the last tick
  double age_s = 0.0;          ///< how long before the read began they were measured; 0 in simulation
};

/// A plant is told this: which switches are on, and its continuous inputs.
struct Command {
  SwitchPattern switches = 0;
  ContinuousValues continuous{};

  bool operator==(const Command&) const = default;
};

/// A plant is a rig, its emulator or a simulation of it.
class Plant {
 public:
  virtual ~Plant() = default;
  /// Returns the channels' values at `time_s`, which never decreases.
  virtual Measurement read(double time_s) noexcept = 0;
  /// Gives a command, which holds until the next one.
  virtual void write(const Command& command) noexcept = 0;
};

}  // namespace solenoid
