#pragma once

#include "controllers/estimators/estimator.hpp"
#include "core/systems/actuator/servo_actuator.hpp"

#include <algorithm>
#include <utility>

namespace solenoid {

/// An estimator of the actuator on servo valves: the valves' spools are simulated from their commands, as they are
/// believed, overlap, hysteresis and leakage included, since nothing measures them; another estimator is told the
/// openings that they give. The state has the signed openings and their rates behind the actuator's own
/// (ServoStateIndex). A Kind of Estimator.
class ServoEstimator {
 public:
  ServoEstimator(Estimator slide, const ServoPair& valves) : slide_(std::move(slide)), valves_(valves) {}

  StateValues update(const Measurement& measured) noexcept {
    valves_.advance();
    StateValues state = slide_.update(measured);
    std::ranges::copy(valves_.state(), state.begin() + opening_a);
    return state;
  }
  /// May be told again in the same tick, if something else was commanded than was wanted.
  void applied(std::span<const double> /*shut*/, const ContinuousValues& continuous) noexcept {
    slide_.applied(valves_.openings(continuous[opening_a_input], continuous[opening_b_input]), continuous);
  }
  EstimateDetail detail() const noexcept { return slide_.detail(); }

 private:
  Estimator slide_;
  ServoPair valves_;
};

}  // namespace solenoid
