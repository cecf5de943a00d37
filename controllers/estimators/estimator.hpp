#pragma once

#include "controllers/estimators/kalman.hpp"
#include "controllers/estimators/moving_horizon.hpp"
#include "controllers/estimators/thesis_estimator.hpp"

#include <variant>

namespace solenoid {

/// The estimator of a variant: sensors in each tick, the inputs in effect until the next one afterwards.
/// promise  update, applied: no allocation, lock or exception
class Estimator {
 public:
  using Kind = std::variant<ThesisEstimator, ActuatorKalman, MovingHorizon>;
  explicit Estimator(Kind kind) : kind_(std::move(kind)) {}

  ActuatorState update(const Sensors& sensors) noexcept {
    return std::visit([&](auto& e) { return e.update(sensors); }, kind_);
  }
  void applied(const SwitchedOf<PneumaticActuator>& opening, double motor_n) noexcept {
    std::visit([&](auto& e) { e.applied(opening, motor_n); }, kind_);
  }
  EstimateDetail detail() const noexcept {
    return std::visit([](const auto& e) { return e.detail(); }, kind_);
  }

 private:
  Kind kind_;
};

}  // namespace solenoid
