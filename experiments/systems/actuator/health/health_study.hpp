#pragma once

#include "experiments/systems/actuator/health/health_run.hpp"

#include <functional>
#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// What is asked of ValveHealth, and of how many plants.
struct HealthStudySettings {
  int plants = 200;                     ///< of each row
  double healthy_hours = 0.1;           ///< of sound plants, simulated
  bool every_kind = false;              ///< valves that leak and slow ones as well as those that are stuck
  std::vector<std::string> variants{};  ///< of tasks/valve_health.toml; none: all
  int jobs = 1;
  double leaking_share = 0.3, late_s = 0.01;
};

/// A coil that fails in one way, at rest or moving, over the plants.
struct HealthRow {
  std::string variant, coil, fault, when;
  int plants = 0;                      ///< runs
  int shown = 0;                       ///< in which the fault showed itself early enough to be judged
  int in_time = 0;                     ///< of those: the right coil and kind found within found_within_s
  int right_coil = 0, wrong_coil = 0;  ///< of all runs
  int alarms = 0;                      ///< found before there was a fault
  std::vector<double> delays_s{};      ///< from showing to being found, right coil
  std::vector<double> before_mm{}, after_mm{};
};
/// What is promised of a stuck coil.
inline constexpr double found_within_s = 0.15;

/// The study's findings.
struct HealthStudy {
  std::vector<HealthRow> rows;
  double healthy_s = 0.0;
  int false_alarms = 0;
  int failed = 0;  ///< workers that did not finish
  bool interrupted = false;
};

/// Simulates each row's plants, and sound ones for as long as is asked, each plant in a process of its own.
HealthStudy study_valve_health(const HealthStudySettings& settings,
                               const std::function<void(const std::string&)>& progress,
                               const std::function<bool()>& interrupted);

/// The table: share found in time, delays, coils that were taken for others, error before and after.
Result result_of(const HealthStudy& study);

}  // namespace solenoid
