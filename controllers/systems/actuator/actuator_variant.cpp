#include "controllers/systems/actuator/actuator_variant.hpp"

#include "controllers/systems.hpp"
#include "controllers/systems/actuator/estimators/actuator_estimator.hpp"
#include "controllers/systems/actuator/estimators/kalman.hpp"
#include "controllers/systems/actuator/estimators/moving_horizon.hpp"
#include "controllers/systems/actuator/estimators/thesis_estimator.hpp"
#include "core/systems/actuator/valves.hpp"

#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

std::vector<EstimatorRow> make_estimator_rows() {
  // What ekf does not know is all a force, which must then be as large and as quick as a hidden payload's.
  EstimatorTuning force_alone;
  force_alone.payload_mean_kg = force_alone.payload_sigma_kg = 0.0;
  force_alone.friction_sigma = 0.0;
  force_alone.force_sigma_n = 30.0;
  force_alone.memory.force_s = 1.0;
  force_alone.pressure_drift_pa = 1e4;
  const auto kalman = [](const PneumaticActuator& model, const EstimatorTuning& tuning) {
    return actuator_estimator(ActuatorKalman(model, tuning));
  };
  return {{"thesis",
           "50 Hz Butterworth on the position, backward difference for the velocity",
           false,
           {},
           [](const PneumaticActuator&, const EstimatorTuning& tuning) {
             return actuator_estimator(ThesisEstimator(tuning.tick_s));
           }},
          {"ekf", "Kalman filter over the sensing chain; one disturbance force", true, force_alone, kalman},
          {"payload_ekf", "the same with payload, flow and friction factors", true, {}, kalman},
          {"mhe",
           "the same by moving horizon",
           true,
           {},
           [](const PneumaticActuator& model, const EstimatorTuning& tuning) {
             return actuator_estimator(MovingHorizon(model, tuning));
           }}};
}

}  // namespace

bool predicts_motor(const VariantConfig& v) {
  const std::string& motor = actuator(v).motor;
  if (motor != "joint") return motor == "in_prediction";
  const SolverRow* row = find_row(system_of(v).solvers(), v.solver);
  return !(row && row->plans_whole_input);
}

bool on_servo_valves(const VariantConfig& v) { return v.modes == servo_valves; }

bool has_residual(const VariantConfig& v) { return !actuator(v).residual.empty(); }

std::string why_no_valve_health(const VariantConfig& v) {
  if (on_servo_valves(v)) return fmt::format("'{}' has no coils (allowed: with valves that switch)", v.modes);
  constexpr const char* allowed =
      "allowed: with a solver that chooses among whatever modes are left, branch_and_bound say";
  if (find_row(system_of(v).laws(), v.solver))
    return fmt::format("the law '{}' cannot do without a coil ({})", v.solver, allowed);
  if (solver_row(v).pulses) return fmt::format("'{}' cuts the pulses of every coil ({})", v.solver, allowed);
  if (v.solver == "extended_cost")
    return fmt::format("'{}' needs a mode with every valve closed ({})", v.solver, allowed);
  return {};
}

MotorInputs make_motor(const VariantConfig& v, const PneumaticActuator& model) {
  MotorLaw law = NoMotor{};
  if (actuator(v).motor == "pd" || predicts_motor(v)) law = PdMotor(model, actuator(v).motor_gains);
  if (actuator(v).motor == "inverse_dynamics") law = InverseDynamicsMotor(model, actuator(v).motor_gains);
  return MotorInputs(law, actuator(v).use_estimate);
}

const std::vector<EstimatorRow>& estimator_rows() {
  static const std::vector<EstimatorRow> rows = make_estimator_rows();
  return rows;
}

const EstimatorRow& estimator_row(std::string_view name) {
  if (const EstimatorRow* row = find_row(estimator_rows(), name)) return *row;
  throw std::invalid_argument(
      fmt::format("no estimator '{}' (allowed: {})", name, fmt::join(names_of(estimator_rows()), ", ")));
}

Estimator make_estimator(std::string_view name, const PneumaticActuator& model, const EstimatorTuning& tuning) {
  return estimator_row(name).make(model, tuning);
}

}  // namespace solenoid
