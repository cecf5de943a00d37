#pragma once

#include "core/metrics/metrics.hpp"
#include "core/mpc/mode_set.hpp"
#include "core/system/signals.hpp"

#include <cstdint>
#include <optional>
#include <string>

namespace solenoid {

/// What the wires say, in volts at the converter's inputs: a system's channels, in the order of its description.
struct RigInputs {
  ChannelValues volts{};
  bool fresh = false;          ///< newer than at the last read; else the last values
  bool node_was_safe = false;  ///< the far side went to its safe state by itself since the last read
  double age_s = 0.0;          ///< how long before the read began they were measured
};

/// What the wires are told: volts for each continuous input and a bit a switch.
struct RigOutputs {
  ContinuousValues volts{};
  SwitchPattern switches = 0;
};

/// How the wire to a far side of its own does.
struct WireHealth {
  Percentiles round_trip_us;            ///< from a request to its answer
  double least_round_trip_us = 0.0;     ///< of the last seconds
  Percentiles age_us;                   ///< of the values that reads returned
  std::int64_t answered = 0, lost = 0;  ///< requests; lost: no answer ever came
  std::int64_t reordered = 0;           ///< answers that a later one overtook
  double drift_ppm = 0.0;               ///< by how much the far clock goes faster than ours
  double clock_error_us = 0.0;          ///< bound of the error of ages
  int clock_jumps = 0;                  ///< of the far clock
  std::int64_t reads = 0, missed = 0;   ///< missed: nothing newer was there
  /// Half of what the 99th percentile of the round trip is above its least: of one direction.
  double jitter_us() const;
  /// Of all requests, those without an answer.
  double loss() const;
  std::string text() const;
};

/// How the connection does.
struct IoHealth {
  std::int64_t reads = 0, missed = 0, late = 0, corrupt = 0, write_errors = 0, node_timeouts = 0;
  std::int64_t asked = 0;  ///< how often another controller asked for the node meanwhile, and was refused
  bool connected = false;
  bool displaced = false;  ///< the node has no session of this controller any more
  std::optional<WireHealth> wire;
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
  /// Forgets what health has counted of the wire so far.
  virtual void watch_anew() noexcept {}
};

}  // namespace solenoid
