#pragma once

#include "controllers/integral_offset.hpp"
#include "controllers/systems/actuator/estimators/tuning.hpp"
#include "controllers/systems/actuator/laws/settings.hpp"
#include "controllers/systems/actuator/motor_inputs.hpp"
#include "core/config/reader.hpp"
#include "core/system/timing.hpp"
#include "core/systems/actuator/parameters.hpp"

#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// What a tick may be [ms].
inline const Range tick_range_ms{0.01, 1000.0};
/// What a control period may be [ms].
inline const Range period_range_ms{0.01, 60000.0};

/// Sampling as a variant or scenario has it; what it does not say is the system's own.
struct TimingKeys {
  std::optional<double> tick_ms, period_ms;
  bool operator==(const TimingKeys&) const = default;
};

/// How far the prediction looks and in which blocks a mode is held.
struct HorizonSettings {
  int steps = 100;          ///< N_p, model steps of a tick
  std::vector<int> blocks;  ///< control periods each; empty: one block of all steps
  bool operator==(const HorizonSettings&) const = default;
};

/// Weights of problem.hpp's cost on position [m], velocity [m/s], coil changes, air [kg] and force [N].
struct CostSettings {
  double position = 1.0, velocity = 0.0, switching = 0.0, air = 0.0;
  double terminal_position = 0.0, terminal_velocity = 0.0;
  double terminal_acceleration = 0.0;  ///< of ExtendedCostSearch
  double motor = 0.0;                  ///< on the squared force that a joint plan chooses
  bool operator==(const CostSettings&) const = default;
};

/// How much work a solver that relaxes and rounds puts into a plan.
struct RoundingSettings {
  bool improve = true;  ///< mode swaps and motor re-optimised after rounding
  int iterations = 15;  ///< of the relaxation before rounding
  bool operator==(const RoundingSettings&) const = default;
};

/// A controller as data: one [variant.NAME] table. The defaults are the thesis's DMPC without integral action; what a
/// key means and may be stands in variant_keys.cpp, which of them a solver or law reads in catalogue.cpp.
struct VariantConfig {
  std::string name;
  std::string summary;  ///< one line for `list`
  std::string valves = "three_way";
  std::string model = "consistent";  ///< a parameter set's name, or a file of parameters
  ActuatorParameters nominal;        ///< `model`, read
  std::string estimator = "thesis";
  EstimatorTuning estimation;         ///< of the estimator's name, with what the variant overrides
  UseEstimate use_estimate;           ///< in the prediction and in inverse dynamics; the state always is
  std::string solver = "exhaustive";  ///< or a feedback law
  TimingKeys own_timing;
  Timing timing;                      ///< the system's with `own_timing`, or a scenario's
  int latency_ticks = 0;              ///< from sampling to a plan's taking effect
  std::optional<double> deadline_ms;  ///< budget of one solve; none: to the end
  HorizonSettings horizon;
  CostSettings cost;
  RoundingSettings rounding;
  IntegralSettings integral;
  std::string motor = "none";
  MotorGains motor_gains;
  PulseWidthSettings pulse_width;
  SlidingSettings sliding;
  PhaseSettings phases;

  /// Whether a motor helps the cylinder.
  bool hybrid() const { return motor != "none"; }
  bool is_feedback_law() const;  ///< `solver` is a law: valves from the present state alone
  /// Whether the prediction has the motor's law in it: the model is then PrestabilisedActuator. Solvers that plan the
  /// whole force need no law.
  bool predicts_motor() const;

  bool operator==(const VariantConfig&) const = default;
};

/// Reads one variant. Throws ConfigError with file, line, key and what is allowed.
VariantConfig read_variant(TableReader& table, const std::string& name);

/// Reads `{ tick_ms = .., period_ms = .. }`.
TimingKeys read_timing_keys(TableReader& table);

/// A system's sampling with what a table `timing` says in its place. Throws ConfigError with the table's place.
Timing with_keys(Timing timing, const TimingKeys& keys, const std::string& where);

/// The variant as it runs where a scenario has its own sampling: that of the variant itself comes first. Throws
/// ConfigError, `where` being the scenario's timing, if the horizon's blocks do not fit.
VariantConfig timed(VariantConfig variant, const TimingKeys& scenario, const std::string& where);

/// Whether two variants are the same controller, whatever they are called.
bool same_controller(VariantConfig a, VariantConfig b);

}  // namespace solenoid
