#pragma once

#include "core/mpc/plan.hpp"
#include "core/reference/trajectory.hpp"
#include "core/rt/io.hpp"

namespace solenoid {

/// What an estimator believes beyond the state, and how well it believes to know it (standard deviations). Zero where it
/// does not say.
struct EstimateDetail {
  double payload_kg = 0.0, payload_sigma_kg = 0.0;
  double disturbance_n = 0.0, disturbance_sigma_n = 0.0;  ///< external force on the slide
  double flow_factor = 1.0, friction_factor = 1.0;
  ActuatorState sigma{};
  double innovation = 0.0;  ///< normalised innovation squared of the tick, chi-square with 3 degrees of freedom
};

/// What a controller decided in a tick, and what it thought.
struct Decision {
  Command command;
  ActuatorState estimate{};
  EstimateDetail detail;
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
