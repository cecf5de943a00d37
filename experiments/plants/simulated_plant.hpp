#pragma once

#include "core/rt/io.hpp"

namespace solenoid {

/// A simulated plant also knows what it cost.
class SimulatedPlant : public Plant {
 public:
  /// Of what the system's models consume, in their unit, since the start.
  virtual double consumed() const = 0;
};

}  // namespace solenoid
