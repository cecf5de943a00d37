#pragma once

#include "core/mpc/plan.hpp"
#include "core/reference/trajectory.hpp"
#include "core/rt/io.hpp"

namespace solenoid {

/// What a controller decided in a tick, and what it thought.
struct Decision {
  Command command;
  ActuatorState estimate{};
  ReferenceSample reference;
  double offset_m = 0.0;  ///< integral offset added to the valves' reference
  bool solved = false;    ///< whether `report` belongs to this tick
  Report report;
};

/// Sensors in, commands out, once a tick. step: no allocation, lock or exception.
class Controller {
 public:
  virtual ~Controller() = default;
  virtual Decision step(const Sensors& sensors) noexcept = 0;
};

}  // namespace solenoid
