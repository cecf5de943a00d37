#pragma once

#include "core/mpc/switch_fault.hpp"
#include "core/rt/io.hpp"

#include <optional>

namespace solenoid {

/// A switch that was found to have failed.
struct FailedSwitch {
  std::size_t c = 0;
  SwitchFault fault;
  bool operator==(const FailedSwitch&) const = default;
};

/// What is left without a switch: nothing, if nothing is.
struct SpareModes {
  FailedSwitch failed;
  std::optional<ModeSet> left;
};

/// Watches the switches of a plant by what its channels show. All but the constructor: no allocation, lock or exception.
class SwitchHealth {
 public:
  virtual ~SwitchHealth() = default;
  /// Takes a tick's channels (NaN: not believed), before anything is commanded in it; returns the switch that these have
  /// shown to have failed, once.
  virtual std::optional<FailedSwitch> update(const Measurement& measured) noexcept = 0;
  /// Whether a switch is suspected, with what was seen so far.
  virtual bool doubts() const noexcept = 0;
  /// Tells what is commanded in this tick; said again, the last counts.
  virtual void commanded(SwitchPattern switches) noexcept = 0;
};

}  // namespace solenoid
