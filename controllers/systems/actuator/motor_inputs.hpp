#pragma once

#include "controllers/systems/actuator/motor_laws.hpp"
#include "core/rt/controller.hpp"
#include "core/systems/actuator/signals.hpp"

namespace solenoid {

/// Which parts of the estimate enter the models that decide, beside the state.
struct UseEstimate {
  bool payload = false, disturbance = false;
  bool operator==(const UseEstimate&) const = default;
};

/// What the actuator has beside its plans: the motor's law, which a joint plan's share adds to, and the load that an
/// estimator finds. The Inputs of an MpcController.
class MotorInputs {
 public:
  explicit MotorInputs(const MotorLaw& law = NoMotor{}, UseEstimate use = {}) : law_(law), use_(use) {}

  /// What the variant uses of the estimate into the model and the law.
  void believe(const EstimateDetail& found, PneumaticActuator& model) noexcept {
    if (!use_.payload && !use_.disturbance) return;
    const double payload_kg = use_.payload ? found.belief[payload_belief] : model.parameters().payload_mass_kg;
    const double external_n = use_.disturbance ? found.belief[disturbance_belief] : 0.0;
    model.set_load(payload_kg, external_n);
    if (auto* law = std::get_if<InverseDynamicsMotor>(&law_)) law->set_load(payload_kg, external_n);
  }

  /// The law alone [N].
  double force(const ReferenceSample& desired, const ActuatorState& x) const noexcept {
    return law_force(law_, desired, x);
  }

  /// Law and planned share, saturated together [N].
  template <HybridModel Model>
  double force(const Model& model, const ReferenceSample& desired, const ActuatorState& x,
               double planned_n) const noexcept {
    double law_n = force(desired, x);
    if (planned_n == 0.0) return law_n;
    // The law of the prediction, before it is saturated alone.
    if constexpr (HasFeedback<Model>)
      law_n =
          model.gains().template force<double>(x[position], x[velocity], {desired.axis[0].value, desired.axis[0].rate});
    return model.template saturated_motor_force<double>(law_n + planned_n);
  }
  /// The same as the model's input.
  template <HybridModel Model>
  Vector<double, 1> apply(const Model& model, const ReferenceSample& desired, const ActuatorState& x,
                          const Vector<double, 1>& planned_n) const noexcept {
    return {force(model, desired, x, planned_n[0])};
  }

 private:
  MotorLaw law_;
  UseEstimate use_;
};

}  // namespace solenoid
