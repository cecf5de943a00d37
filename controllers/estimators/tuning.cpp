#include "controllers/estimators/tuning.hpp"

#include "core/config/reader.hpp"

namespace solenoid {

EstimatorTuning estimator_tuning(const std::string& estimator) {
  EstimatorTuning t;
  if (estimator == "ekf") {
    // Everything unknown is a force, which must then be as large and as quick as a hidden payload's.
    t.payload_mean_kg = t.payload_sigma_kg = 0.0;
    t.friction_sigma = 0.0;
    t.force_sigma_n = 30.0;
    t.memory.force_s = 1.0;
    t.pressure_drift_pa = 1e4;
  }
  return t;
}

void read_estimator_tuning(TableReader& table, EstimatorTuning& t) {
  const Range positive = Range::positive(), non_negative = Range::non_negative();
  const auto read = [&table](const char* key, double& value, const Range& range) {
    value = table.number_or(key, value, range);
  };
  read("position_sigma_m", t.position_sigma_m, positive);
  read("position_quantum_m", t.position_quantum_m, non_negative);
  read("position_low_m", t.position_low_m, Range::any());
  read("position_high_m", t.position_high_m, {t.position_low_m, 10.0, true});
  read("pressure_low_pa", t.pressure_low_pa, Range::any());
  read("pressure_high_pa", t.pressure_high_pa, {t.pressure_low_pa, 1e7, true});
  read("pressure_filter_hz", t.pressure_filter_hz, Range::between(0.0, 400.0));
  read("pressure_sigma_pa", t.pressure_sigma_pa, positive);
  read("pressure_input_sigma_pa", t.pressure_input_sigma_pa, non_negative);
  read("gate_sigmas", t.gate_sigmas, positive);
  read("force_sigma_n", t.force_sigma_n, non_negative);
  read("payload_mean_kg", t.payload_mean_kg, non_negative);
  read("payload_sigma_kg", t.payload_sigma_kg, non_negative);
  read("payload_drift", t.payload_drift, non_negative);
  read("flow_sigma", t.flow_sigma, non_negative);
  read("friction_sigma", t.friction_sigma, non_negative);
  read("pressure_drift_pa", t.pressure_drift_pa, positive);
  read("force_white_n", t.force_white_n, positive);
  read("force_memory_s", t.memory.force_s, {0.005, 1e6, true});
  read("flow_memory_s", t.memory.flow_s, {0.005, 1e6, true});
  read("friction_memory_s", t.memory.friction_s, {0.005, 1e6, true});
  t.window_ticks = table.integer_or("window_ticks", t.window_ticks, 20, 50);
  t.iterations = table.integer_or("iterations", t.iterations, 1, 5);
  table.finish();
}

}  // namespace solenoid
