#pragma once

#include "core/systems/actuator/parameters.hpp"
#include "experiments/systems/actuator/identify/estimate.hpp"
#include "experiments/systems/actuator/identify/record.hpp"

#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// Mean and t interval of repeated tests, as Table 4-1 of the thesis is to be read.
Findings static_friction_from_tests(const std::vector<double>& forces_n, const std::string& method);

/// Static friction from the spans labelled "ramp": the force, motor and cylinder, at the moment the slide broke away.
/// That moment is found between samples: the position before it is constant, after it a cubic, because the force in
/// excess rises in a line (position_m to the noise, not to a threshold).
Findings estimate_breakaway(const Record& record, const ActuatorParameters& given);

/// A run at constant speed: mean force against friction (its direction's sign taken out) and mean speed.
struct SpeedRun {
  double speed_m_s, force_n;
};

/// F = F_cf + C_vf |v| over runs, (4.15): ordinary least squares, Student's t with n - 2 degrees of freedom.
Findings friction_from_runs(const std::vector<SpeedRun>& runs, const std::string& method);

/// The same from the spans labelled "speed": of each its middle part, the force less m_eq times the mean acceleration.
Findings estimate_constant_speeds(const Record& record, const ActuatorParameters& given, double mass_kg,
                                  double filter_delay_s);

/// What Table 4-2 says about C_vf.
struct Table42Reading {
  std::string reading;
  Estimate coulomb, viscous;
  double between_sets = 0;  ///< slope between the two means
  bool determines = false;  ///< interval above zero and no wider than the value
};
struct Table42Verdict {
  std::vector<Table42Reading> readings;
  bool determines = false;
  std::string text;
};
Table42Verdict judge_table_4_2();

/// Table 4-1's mean and interval.
Estimate static_friction_of_table_4_1();

}  // namespace solenoid
