#pragma once

#include "controllers/estimators/estimator.hpp"
#include "controllers/motor_laws.hpp"
#include "controllers/timing.hpp"
#include "controllers/variant.hpp"
#include "core/mpc/deadline.hpp"
#include "core/mpc/problem.hpp"
#include "core/rt/controller.hpp"

#include <algorithm>
#include <optional>

namespace solenoid {

/// What every predictive controller does around its solver: from the sensors to a posed problem.

/// The state into `d`, and what the prediction uses of the rest of the estimate into `model` and into a
/// motor law that has a model. Under ideal sensing the true state passes the estimator by.
template <HybridModel Model>
void take_estimate(const Sensors& sensors, const UseEstimate& use, Estimator& estimator, Model& model, MotorLaw& motor,
                   Decision& d) noexcept {
  if (sensors.ideal) {
    d.estimate = sensors.truth;
    return;
  }
  d.estimate = estimator.update(sensors);
  d.detail = estimator.detail();
  if (!use.payload && !use.disturbance) return;
  const double payload_kg = use.payload ? d.detail.payload_kg : model.parameters().payload_mass_kg;
  const double external_n = use.disturbance ? d.detail.disturbance_n : 0.0;
  model.set_load(payload_kg, external_n);
  if (auto* law = std::get_if<InverseDynamicsMotor>(&motor)) law->set_load(payload_kg, external_n);
}

/// The reference ahead of `time_s`, shifted by the integral's offset, for a problem that begins `lead` ticks later.
template <HybridModel Model, class Reference>
void pose_reference(const Reference& reference, double time_s, int lead, double offset_m,
                    Problem<Model>& problem) noexcept {
  for (std::size_t j = 0; j < problem.reference.size(); ++j) {
    const double step = lead + static_cast<double>(j);
    const ReferenceSample end = reference.at(time_s + (step + 1.0) * tick_s);
    problem.reference[j] = {end.position + offset_m, end.velocity};
    if constexpr (HasFeedback<Model>) {
      const ReferenceSample begin = reference.at(time_s + step * tick_s);
      problem.setpoint[j] = {begin.position, begin.velocity};
    }
  }
}

/// The end of a solve's budget, counted from now; none: never.
inline Deadline deadline_in(const std::optional<double>& budget_ms) {
  if (!budget_ms) return Deadline::never();
  return Deadline::after(std::chrono::nanoseconds(static_cast<std::int64_t>(*budget_ms * 1e6)));
}

}  // namespace solenoid
