#include "controllers/estimators/estimator.hpp"

#include <stdexcept>

namespace solenoid {

Estimator::Kind Estimator::make(const std::string& name, const PneumaticActuator& model,
                                const EstimatorTuning& tuning) {
  if (name == "thesis") return ThesisEstimator();
  if (name == "ekf" || name == "payload_ekf") return ActuatorKalman(model, tuning);
  if (name == "mhe") return MovingHorizon(model, tuning);
  throw std::invalid_argument("no estimator '" + name + "' (allowed: thesis, ekf, payload_ekf, mhe)");
}

Estimator::Estimator(const std::string& name, const PneumaticActuator& model, const EstimatorTuning& tuning)
    : kind_(make(name, model, tuning)) {}

}  // namespace solenoid
