#pragma once

#include <cstdint>
#include <string>

namespace solenoid {

/// A sensor can fail in these ways (core/safety/plausibility.hpp).
enum class SensorFault : std::uint8_t {
  not_finite,  ///< no number
  range,       ///< outside what the quantity can be
  rail,        ///< at an end of the converter
  slew,        ///< faster than the plant or the filter before it can move
  stuck,       ///< unchanged although it must change
  stale,       ///< not measured in this tick
  supply,      ///< a pressure no chamber between atmosphere and supply can have
  innovation,  ///< at odds with what the model makes of the other sensors
};
/// How many ways there are.
inline constexpr int sensor_fault_kinds = 8;
/// The sensors of the actuator.
enum class Sensor : std::uint8_t { position, pressure_a, pressure_b };
/// How many sensors there are.
inline constexpr int sensor_count = 3;

/// These things beside the sensors can be wrong.
enum class Fault : std::uint8_t {
  position_limit = sensor_count * sensor_fault_kinds,
  pressure_limit,
  command_refused,  ///< the exit had to replace a command by its safe value
  tick_gap,         ///< the loop stood still for long
  node_safe,        ///< the I/O missed commands and went to its safe state
  no_plan,          ///< every rung that stands in for the solver is used up
  stopped,          ///< by the operator, or at the end of the run
  aborted,          ///< by the program: the log, the preparation
};
/// Bits of a FaultSet: a sensor's kinds for each sensor, then the faults beside them.
inline constexpr int fault_kinds = static_cast<int>(Fault::aborted) + 1;

/// A set of faults, one bit each.
class FaultSet {
 public:
  constexpr FaultSet() = default;
  constexpr explicit FaultSet(std::uint64_t bits) : bits_(bits) {}
  constexpr void add(Sensor sensor, SensorFault kind) noexcept { bits_ |= bit(index(sensor, kind)); }
  constexpr void add(Fault fault) noexcept { bits_ |= bit(static_cast<int>(fault)); }
  constexpr bool has(Sensor sensor, SensorFault kind) const noexcept { return bits_ & bit(index(sensor, kind)); }
  constexpr bool has(Fault fault) const noexcept { return bits_ & bit(static_cast<int>(fault)); }
  constexpr bool any(Sensor sensor) const noexcept {
    return bits_ & (std::uint64_t{(1u << sensor_fault_kinds) - 1} << (static_cast<int>(sensor) * sensor_fault_kinds));
  }
  constexpr bool empty() const noexcept { return bits_ == 0; }
  constexpr std::uint64_t bits() const noexcept { return bits_; }
  constexpr FaultSet& operator|=(FaultSet other) noexcept {
    bits_ |= other.bits_;
    return *this;
  }
  constexpr bool operator==(const FaultSet&) const = default;

 private:
  static constexpr int index(Sensor sensor, SensorFault kind) {
    return static_cast<int>(sensor) * sensor_fault_kinds + static_cast<int>(kind);
  }
  static constexpr std::uint64_t bit(int i) { return std::uint64_t{1} << i; }
  std::uint64_t bits_ = 0;
};

/// Names the faults: "position slew, tick gap", or "none". Allocates.
std::string to_string(FaultSet faults);

}  // namespace solenoid
