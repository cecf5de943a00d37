#pragma once

#include "experiments/systems/actuator/commission/commission.hpp"

#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// What has been found so far: one file in the results folder, written anew after every step.
struct CommissionRecord {
  std::string variant, plant, plane;
  std::vector<StepOutcome> steps;  ///< in the order of commission_steps(), each at most once

  /// Puts a step's outcome in the place of an earlier one of it.
  void add(StepOutcome outcome);
  /// Leaves only what is before this step.
  void forget_from(const std::string& step);
  /// Everything that is wrong, in words.
  std::vector<std::string> findings() const;
  bool all_good() const;  ///< some step passed, and none failed or was stopped

  std::string json() const;
  /// Throws ConfigError for what is no such record, and for one of another variant or plane.
  static CommissionRecord parse(const std::string& text, const std::string& name);
};

/// "force_when_moved 2.6 N (0.3 to 6)".
std::string text_of(const Measured& measured);
/// For a person: each step and how it ended, what was found.
Result result_of(const CommissionRecord& record);
/// The steps and what they ask, for --list.
Result steps_result();

}  // namespace solenoid
