#pragma once

#include "controllers/systems/actuator/estimators/loaded_actuator.hpp"

namespace solenoid {

/// What an estimator believes of the sensors and of what the model leaves out. A standard deviation of zero for payload
/// or a factor fixes it at its mean. The defaults are payload_ekf's; other rows of the catalogue change some.
struct EstimatorTuning {
  double tick_s = 0.001;  ///< between measurements

  // Sensors (model.md, section 6).
  double position_sigma_m = 0.03e-3;                      ///< white noise of the unfiltered potentiometer
  double position_quantum_m = 0.02e-3;                    ///< converter step
  double position_low_m = -0.01, position_high_m = 0.11;  ///< what the potentiometer's channel can show
  double pressure_filter_hz = 50.0;                       ///< cut-off of the hardware Bessel filter; 0: none
  double pressure_sigma_pa = 60.0;                        ///< noise after the filter, quantisation included
  double pressure_input_sigma_pa = 850.0;  ///< noise and spikes before it, as white noise held for a tick
  double pressure_low_pa = 101325.0 - 210e3,
         pressure_high_pa = 101325.0 + 210e3;  ///< what the sensors can show, absolute
  double gate_sigmas = 5.0;                    ///< innovations beyond this many standard deviations lose weight

  // The plant beyond the model.
  double force_sigma_n = 0.6;  ///< external force: stationary standard deviation
  double payload_mean_kg = 0.1, payload_sigma_kg = 0.2;
  double payload_drift = 0.004;  ///< [kg / s^0.5]
  double flow_sigma = 0.12, friction_sigma = 0.5;
  double pressure_drift_pa = 5e3;  ///< [Pa / s^0.5]
  double force_white_n = 0.3;      ///< unmodelled force of one tick
  LoadedActuator::Memory memory;
  ForceResidual residual;  ///< the part of it that the state explains; no key of `estimation`

  // Moving horizon.
  int window_ticks = 25;
  int iterations = 2;

  /// Measurement variance of one position sample [m2].
  double position_variance() const {
    return position_sigma_m * position_sigma_m + position_quantum_m * position_quantum_m / 12;
  }
  bool operator==(const EstimatorTuning&) const = default;
};

}  // namespace solenoid
