#pragma once

#include "controllers/timing.hpp"
#include "core/rt/controller.hpp"
#include "core/signal/filters.hpp"

#include <array>

namespace solenoid {

/// The thesis's state estimate (5.3): position through the 50 Hz Butterworth filter, velocity as its backward
/// difference, pressures as measured. Its lag of about 4.5 ms is part of the thesis's results (model.md, E13).
class ThesisEstimator {
 public:
  /// A value that is no number is replaced by the last one.
  ActuatorState update(Sensors sensors) noexcept {
    replace(sensors.position_m, last_[0]);
    replace(sensors.pressure_a_pa, last_[1]);
    replace(sensors.pressure_b_pa, last_[2]);
    if (!started_) {
      filter_.reset(sensors.position_m);
      difference_.reset(sensors.position_m);
      started_ = true;
    }
    const double y = filter_.step(sensors.position_m);
    return {y, difference_.step(y), sensors.pressure_a_pa, sensors.pressure_b_pa};
  }
  /// It has no model that inputs could move.
  void applied(const SwitchedOf<PneumaticActuator>&, double) noexcept {}
  EstimateDetail detail() const noexcept { return {}; }

 private:
  static void replace(double& value, double& last) noexcept {
    if (std::isfinite(value))
      last = value;
    else
      value = last;
  }
  std::array<double, 3> last_{};
  Butterworth2 filter_{50.0, 1.0 / tick_s};
  BackwardDifference difference_{tick_s};
  bool started_ = false;
};

}  // namespace solenoid
