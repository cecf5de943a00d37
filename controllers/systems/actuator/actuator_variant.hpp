#pragma once

#include "controllers/catalogue.hpp"
#include "controllers/estimators/estimator.hpp"
#include "controllers/systems/actuator/estimators/tuning.hpp"
#include "controllers/systems/actuator/laws/settings.hpp"
#include "controllers/systems/actuator/motor_inputs.hpp"
#include "controllers/systems/actuator/servo_inputs.hpp"
#include "controllers/variant.hpp"
#include "core/systems/actuator/parameters.hpp"
#include "core/systems/actuator/residual_actuator.hpp"

#include <concepts>
#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// What a variant of the actuator says beside what every variant does. The defaults are the thesis's cylinder alone.
struct ActuatorVariant {
  std::string model = "consistent";  ///< a parameter set's name, or a file of parameters
  ActuatorParameters nominal;        ///< `model`, read
  ForceResidual residual;            ///< beside the model's equations, in prediction and estimator; or none
  EstimatorTuning estimation;        ///< of the estimator's name, with what the variant overrides
  UseEstimate use_estimate;          ///< in the prediction and in inverse dynamics; the state always is
  std::string motor = "none";
  MotorGains motor_gains;
  PulseWidthSettings pulse_width;
  SlidingSettings sliding;
  SevenModeSettings seven_mode;
  PhaseSettings phases;
  EndPositionSettings end_position;
  ServoPidSettings servo_pid;
  ServoSettings servo;
  bool valve_health = false;           ///< whether coils that fail are found and done without
  double terminal_acceleration = 0.0;  ///< weight of ExtendedCostSearch

  /// Whether a motor helps the cylinder.
  bool hybrid() const { return motor != "none"; }
  bool operator==(const ActuatorVariant&) const = default;
};

/// A variant's own settings, which are the actuator's.
inline const ActuatorVariant& actuator(const VariantConfig& variant) { return variant.own.as<ActuatorVariant>(); }
/// The same, to be changed.
inline ActuatorVariant& actuator(VariantConfig& variant) { return variant.own.as<ActuatorVariant>(); }

/// Whether the prediction has the motor's law in it: the model is then PrestabilisedActuator. Solvers that plan the whole
/// force need no law.
bool predicts_motor(const VariantConfig& variant);

/// Whether a servo valve a chamber is in place of valves that switch: the model is then ServoActuator, or with the motor's
/// law PrestabilisedServo.
bool on_servo_valves(const VariantConfig& variant);

/// Whether a force that its model leaves out was identified: the model is then ResidualActuator, with or without the motor's
/// law.
bool has_residual(const VariantConfig& variant);

/// Why a variant cannot do without a coil that fails, with what could; empty: it can.
std::string why_no_valve_health(const VariantConfig& variant);

/// What the variant believes.
template <HybridModel Model>
Model make_model(const VariantConfig& v) {
  if constexpr (std::same_as<Model, PrestabilisedServo>)
    return Model(actuator(v).nominal, actuator(v).motor_gains, v.timing.tick_s);
  else if constexpr (std::same_as<Model, ServoActuator>)
    return Model(actuator(v).nominal, v.timing.tick_s);
  else if constexpr (std::same_as<Model, ResidualActuator>)
    return Model(actuator(v).nominal, predicts_motor(v) ? actuator(v).motor_gains : MotorGains{0.0, 0.0},
                 actuator(v).residual);
  else if constexpr (HasFeedback<Model>)
    return Model(actuator(v).nominal, actuator(v).motor_gains);
  else
    return Model(actuator(v).nominal);
}

/// The motor's law beside the valves, and what the variant uses of the estimate.
MotorInputs make_motor(const VariantConfig& variant, const PneumaticActuator& model);

/// An estimator through the sensing chain.
struct EstimatorRow {
  std::string name, summary;
  bool finds_load = false;  ///< payload and disturbance, for `use_estimate`
  EstimatorTuning tuning;   ///< what a variant has that does not say
  Estimator (*make)(const PneumaticActuator& model, const EstimatorTuning& tuning);
};

/// The estimators there are.
const std::vector<EstimatorRow>& estimator_rows();
/// The row of this name; throws std::invalid_argument, naming what is allowed.
const EstimatorRow& estimator_row(std::string_view name);
/// The estimator of this name over a nominal model. May allocate; throws std::invalid_argument.
Estimator make_estimator(std::string_view name, const PneumaticActuator& model, const EstimatorTuning& tuning);

/// Its feedback laws.
std::vector<LawRow> actuator_laws();
/// Its solvers beside those of every system.
std::vector<SolverRow> actuator_solvers();

}  // namespace solenoid
