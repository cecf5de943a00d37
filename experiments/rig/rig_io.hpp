#pragma once

#include "core/mpc/mode_set.hpp"
#include "core/system/signals.hpp"

#include <cstdint>
#include <string>

namespace solenoid {

/// What the wires say, in volts at the converter's inputs: a system's channels, in the order of its description.
struct RigInputs {
  ChannelValues volts{};
  bool fresh = false;          ///< measured for this read; else the last values
  bool node_was_safe = false;  ///< the far side went to its safe state by itself since the last read
};

/// What the wires are told: volts for each continuous input and a bit a switch.
struct RigOutputs {
  ContinuousValues volts{};
  SwitchPattern switches = 0;
};

/// How the connection does.
struct IoHealth {
  std::int64_t reads = 0, missed = 0, late = 0, corrupt = 0, write_errors = 0, node_timeouts = 0;
  std::int64_t asked = 0;  ///< how often another controller asked for the node meanwhile, and was refused
  bool connected = false;
  bool displaced = false;  ///< the node has no session of this controller any more
  std::string text() const;
};

/// A rig's inputs and outputs in SI units of the wires; calibration lies above (calibration.hpp). Between open and safe
/// the caller reads and writes once a tick.
/// read, write: no allocation, lock or exception, and never longer than a fraction of a tick if the far side is gone.
class RigIo {
 public:
  virtual ~RigIo() = default;
  /// Throws ConfigError (what is configured cannot be) or OutputError (it is not there). Outputs are safe afterwards.
  virtual void open() = 0;
  virtual RigInputs read() noexcept = 0;
  virtual void write(const RigOutputs& outputs) noexcept = 0;
  /// The safe outputs: the mode set's safe pattern, continuous inputs 0. Async-signal-safe: a crash handler calls it.
  virtual void safe() noexcept = 0;
  virtual IoHealth health() const noexcept = 0;
};

}  // namespace solenoid
