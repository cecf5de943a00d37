#pragma once

#include "core/rt/controller.hpp"
#include "core/systems/actuator/dynamics.hpp"

#include <memory>
#include <utility>

namespace solenoid {

/// The estimator of a variant, of whatever kind: sensors in each tick, the inputs in effect until the next one
/// afterwards. A kind has the three functions below; the catalogue has a row for each.
/// promise  update, applied, detail: no allocation, lock or exception
class Estimator {
 public:
  /// Of a kind; allocates.
  template <class Kind>
  explicit Estimator(Kind kind) : kind_(std::make_unique<Of<Kind>>(std::move(kind))) {}

  /// Takes a tick's sensors and returns the state estimate. NaN stands for a value that is missing.
  ActuatorState update(const Sensors& sensors) noexcept { return kind_->update(sensors); }
  /// Tells which valve openings and motor force act until the next tick.
  void applied(const SwitchedOf<PneumaticActuator>& opening, double motor_n) noexcept {
    kind_->applied(opening, motor_n);
  }
  /// What is believed beyond the state, and how well.
  EstimateDetail detail() const noexcept { return kind_->detail(); }

 private:
  struct Any {
    virtual ~Any() = default;
    virtual ActuatorState update(const Sensors& sensors) noexcept = 0;
    virtual void applied(const SwitchedOf<PneumaticActuator>& opening, double motor_n) noexcept = 0;
    virtual EstimateDetail detail() const noexcept = 0;
  };
  template <class Kind>
  struct Of final : Any {
    explicit Of(Kind k) : kind(std::move(k)) {}
    ActuatorState update(const Sensors& sensors) noexcept override { return kind.update(sensors); }
    void applied(const SwitchedOf<PneumaticActuator>& opening, double motor_n) noexcept override {
      kind.applied(opening, motor_n);
    }
    EstimateDetail detail() const noexcept override { return kind.detail(); }
    Kind kind;
  };

  std::unique_ptr<Any> kind_;
};

}  // namespace solenoid
