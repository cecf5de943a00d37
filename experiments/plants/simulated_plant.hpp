#pragma once

#include "core/rt/io.hpp"

namespace solenoid {

/// A simulated plant also knows what it cost.
class SimulatedPlant : public Plant {
 public:
  virtual double air_used_kg() const = 0;
};

}  // namespace solenoid
