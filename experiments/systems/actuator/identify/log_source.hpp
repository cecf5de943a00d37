#pragma once

#include "experiments/systems/actuator/identify/record.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// What a log does not say itself.
struct LogSettings {
  /// Columns of a CSV: `time_s=t`, `position_m=y_mm*1e-3`, ... : our name, the file's, optionally a factor. Ours are
  /// time_s, position_m, pressure_a_pa, pressure_b_pa, motor_n, coils, and label, which may be missing. Empty: the
  /// columns are named so.
  std::vector<std::string> columns;
  std::string valves = "two_way";
  Plane plane = Plane::vertical;
};

/// A log as a record: MCAP of `solenoid run`, or CSV. Uneven times are brought to the commonest period, commands held
/// and measurements in straight lines. Throws ConfigError naming file, line, column and what is allowed.
Record read_log_record(const std::string& path, const LogSettings& settings);
/// The same from a CSV's text.
Record record_from_csv(const std::string& text, const std::string& path, const LogSettings& settings);

/// A record as CSV that record_from_csv reads back to the last digit.
std::string record_csv(const Record& record);

}  // namespace solenoid
