#pragma once

#include "core/mpc/switch_fault.hpp"
#include "core/rt/io.hpp"

#include <optional>
#include <string_view>

namespace solenoid {

/// A simulated plant also knows what it cost.
class SimulatedPlant : public Plant {
 public:
  /// Of what the system's models consume, in their unit, since the start.
  virtual double consumed() const = 0;
  /// Makes switch c fail, or be sound again, from now on. A plant whose switches cannot does nothing.
  virtual void fail_switch(std::size_t /*c*/, const SwitchFault& /*fault*/) noexcept {}
  /// Makes a part that is no switch fail by a value, or be sound again (none), from now on: of the faults that
  /// SimulatedSystem::actuation_faults() says are the plant's own, by their target.
  virtual void fail_part(std::string_view /*part*/, std::optional<double> /*value*/) noexcept {}
};

}  // namespace solenoid
