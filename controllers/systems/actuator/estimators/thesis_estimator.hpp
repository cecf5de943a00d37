#pragma once

#include "core/rt/controller.hpp"
#include "core/signal/filters.hpp"
#include "core/systems/actuator/signals.hpp"

#include <array>

namespace solenoid {

/// The thesis's state estimate (5.3): position through the 50 Hz Butterworth filter, velocity as its backward
/// difference, pressures as measured. Its lag of about 4.5 ms is part of the thesis's results (model.md, E13).
class ThesisEstimator {
 public:
  explicit ThesisEstimator(double tick_s) : filter_(50.0, 1.0 / tick_s), difference_(tick_s) {}

  /// A value that is no number is replaced by the last one.
  ActuatorState update(Measurement sensors) noexcept {
    replace(sensors.value[position_channel], last_[0]);
    replace(sensors.value[pressure_a_channel], last_[1]);
    replace(sensors.value[pressure_b_channel], last_[2]);
    if (!started_) {
      filter_.reset(sensors.value[position_channel]);
      difference_.reset(sensors.value[position_channel]);
      started_ = true;
    }
    const double y = filter_.step(sensors.value[position_channel]);
    return {y, difference_.step(y), sensors.value[pressure_a_channel], sensors.value[pressure_b_channel]};
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
  Butterworth2 filter_;
  BackwardDifference difference_;
  bool started_ = false;
};

}  // namespace solenoid
