#pragma once

#include "core/system/description.hpp"

#include <cstdint>
#include <string>

namespace solenoid {

/// A measured channel can fail in these ways (core/safety/plausibility.hpp).
enum class SensorFault : std::uint8_t {
  not_finite,  ///< no number
  range,       ///< outside what the quantity can be
  rail,        ///< at an end of the converter
  slew,        ///< faster than the plant or the filter before it can move
  stuck,       ///< unchanged although it must change
  stale,       ///< not measured in this tick
  supply,      ///< for long beyond what the plant's supply can bring about
  innovation,  ///< at odds with what the model makes of the other channels
};
/// How many ways there are.
inline constexpr int sensor_fault_kinds = 8;

/// These things beside the channels can be wrong.
enum class Fault : std::uint8_t {
  axis_limit,       ///< an axis is beyond its limits
  channel_limit,    ///< another channel is
  command_refused,  ///< the exit had to replace a command by its safe value
  tick_gap,         ///< the loop stood still for long
  node_safe,        ///< the I/O missed commands and went to its safe state
  no_plan,          ///< every rung that stands in for the solver is used up
  stopped,          ///< by the operator, or at the end of the run
  aborted,          ///< by the program: the log, the preparation
  switch_failed,    ///< a switch was found to have failed; the others go on
  switches_lost,    ///< and nothing is left, or a second one has
};
/// How many of them there are.
inline constexpr int other_faults = 10;

/// A set of faults, one bit each, as logs keep them: the kinds of channels 0 to 2 in bits 0 to 23, the other faults in
/// 24 to 31, the kinds of channels 3 to 5 from bit 32 on, what is behind the eighth of the other faults from bit 56 on.
class FaultSet {
 public:
  /// Channels whose kinds come before the other faults.
  static constexpr std::size_t channels_below = 3;

  constexpr FaultSet() = default;
  constexpr explicit FaultSet(std::uint64_t bits) : bits_(bits) {}
  constexpr void add(std::size_t channel, SensorFault kind) noexcept { bits_ |= bit(index(channel, kind)); }
  constexpr void add(Fault fault) noexcept { bits_ |= bit(index(fault)); }
  constexpr bool has(std::size_t channel, SensorFault kind) const noexcept { return bits_ & bit(index(channel, kind)); }
  constexpr bool has(Fault fault) const noexcept { return bits_ & bit(index(fault)); }
  constexpr bool any(std::size_t channel) const noexcept {
    return bits_ & (std::uint64_t{(1u << sensor_fault_kinds) - 1} << index(channel, SensorFault{}));
  }
  constexpr bool empty() const noexcept { return bits_ == 0; }
  constexpr std::uint64_t bits() const noexcept { return bits_; }
  constexpr FaultSet& operator|=(FaultSet other) noexcept {
    bits_ |= other.bits_;
    return *this;
  }
  constexpr bool operator==(const FaultSet&) const = default;

 private:
  static constexpr int index(std::size_t channel, SensorFault kind) {
    const int place = static_cast<int>(channel) + (channel >= channels_below ? 1 : 0);
    return place * sensor_fault_kinds + static_cast<int>(kind);
  }
  static constexpr int index(Fault fault) {
    const int i = static_cast<int>(fault);
    return i < sensor_fault_kinds ? first_other + i : further_others + i - sensor_fault_kinds;
  }
  static constexpr int further_others = 56;
  static constexpr int first_other = static_cast<int>(channels_below) * sensor_fault_kinds;
  static constexpr std::uint64_t bit(int i) { return std::uint64_t{1} << i; }
  std::uint64_t bits_ = 0;
};

/// Names the faults, channels by their labels: "position slew, tick gap", or "none". Allocates.
std::string to_string(FaultSet faults, const SystemDescription& system);

}  // namespace solenoid
