#pragma once

#include "controllers/estimators/estimator.hpp"
#include "core/systems/actuator/signals.hpp"

namespace solenoid {

/// An estimator of the actuator, in its own quantities, as an Estimator in those of records.
///
/// Kind:  ActuatorState update(const Measurement&) noexcept;  EstimateDetail detail() const noexcept
///        applied(const SwitchedOf<PneumaticActuator>& opening, double motor_n) noexcept
template <class Kind>
struct OfActuator {
  Kind kind;
  StateValues update(const Measurement& measured) noexcept { return padded<max_states>(kind.update(measured)); }
  void applied(std::span<const double> opening, const ContinuousValues& continuous) noexcept {
    SwitchedOf<PneumaticActuator> own{};
    std::ranges::copy(opening, own.begin());
    kind.applied(own, continuous[0]);
  }
  EstimateDetail detail() const noexcept { return kind.detail(); }
};

/// The Estimator of such a kind.
template <class Kind>
Estimator actuator_estimator(Kind kind) {
  return Estimator(OfActuator<Kind>{std::move(kind)});
}

}  // namespace solenoid
