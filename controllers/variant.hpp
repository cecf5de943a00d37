#pragma once

#include "controllers/baselines/settings.hpp"
#include "controllers/estimators/tuning.hpp"
#include "controllers/integral_offset.hpp"
#include "controllers/motor_laws.hpp"
#include "core/actuator/parameters.hpp"

#include <optional>
#include <string>
#include <vector>

namespace solenoid {

class TableReader;

/// Which parts of the estimate enter the prediction model beside the state.
struct UseEstimate {
  bool payload = false, disturbance = false;
};

/// A controller as data: one [variant.NAME] table. The defaults are the thesis's DMPC without integral action.
struct VariantConfig {
  std::string name;
  std::string summary;  ///< one line for `list`
  std::string valves = "three_way";
  std::string model = "consistent";  ///< a parameter set's name, or a file of parameters
  ActuatorParameters believed;       ///< `model`, read
  std::string estimator = "thesis";
  EstimatorTuning estimation;  ///< of the estimator's name, with what the variant overrides
  UseEstimate use_estimate;    ///< in the prediction and in inverse dynamics; the state always is
  int latency_ticks = 0;       ///< from sampling to a plan's taking effect
  std::string solver = "exhaustive";
  int steps = 100;                 ///< N_p, model steps of 1 ms
  std::vector<int> blocks = {20};  ///< 5 ms periods each; empty: one block of all steps
  double position_weight = 1.0, velocity_weight = 0.0, switching_weight = 0.0, air_weight = 0.0;
  double terminal_position_weight = 0.0, terminal_velocity_weight = 0.0;
  double motor_weight = 0.0;  ///< on the squared motor force that a joint plan adds to the law [1/N2]
  IntegralSettings integral;
  std::string motor = "none";
  MotorGains motor_gains;
  bool rounding_improves = true;              ///< mode swaps and motor re-optimised after rounding
  int relaxing_iterations = 15;               ///< of the relaxation before rounding
  std::optional<double> deadline_ms;          ///< budget of one solve; none: to the end
  double terminal_acceleration_weight = 0.0;  ///< of ExtendedCostSearch
  PulseWidthSettings pulse_width;             ///< of the valve laws
  SlidingSettings sliding;
  PhaseSettings phases;

  bool relaxed() const;  ///< solver is one of VariantChoices::relaxed_solvers()
  bool lawful() const;   ///< solver is one of VariantChoices::laws()
  bool hybrid() const { return motor != "none"; }
  /// Whether the prediction has the motor's law in it: the model is then PrestabilisedActuator. Relaxed joint plans
  /// choose the whole force themselves.
  bool predicts_motor() const { return motor == "in_prediction" || (motor == "joint" && !relaxed()); }
};

/// Values a variant's keys may take, for checks and help.
struct VariantChoices {
  static const std::vector<std::string>& estimators();
  static const std::vector<std::string>& estimate_uses();
  static const std::vector<std::string>& solvers();          ///< of mode sequences: Solver
  static const std::vector<std::string>& relaxed_solvers();  ///< RelaxedSolver
  static const std::vector<std::string>& laws();             ///< no solver at all: valves from the present state alone
  static const std::vector<std::string>& motors();
};

/// Reads one variant. Throws ConfigError with file, line, key and what is allowed.
VariantConfig read_variant(TableReader& table, const std::string& name);

}  // namespace solenoid
