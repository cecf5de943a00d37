#pragma once

#include "experiments/logs/csv_reader.hpp"
#include "experiments/systems/actuator/identify/log_samples.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// What a log does not say itself.
struct LogSettings {
  /// Where our numbers are, if they are called otherwise: `time_s=t`, `position_m=y_mm*1e-3`,
  /// `pressure_a_pa=pA*1e5+101325`: our name, the file's, optionally a factor and an offset. Ours are time_s, position_m,
  /// pressure_a_pa, pressure_b_pa, motor_n, coils, and label, which may be missing. Of an MCAP that is no log of `run`:
  /// `position_m=/slide.position.x*1e-3`, a topic and a field of its JSON messages, for each but time_s and label.
  std::vector<std::string> columns;
  CsvDialect dialect;
  std::string valves = "two_way";
  Plane plane = Plane::vertical;
};

/// A log as records: MCAP of `solenoid run`, JSON channels of another MCAP, or CSV. Throws ConfigError naming file, line, column and what is allowed.
LogRecords read_log_records(const std::string& path, const LogSettings& settings);
/// The same from a CSV's text.
LogRecords records_from_csv(const std::string& text, const std::string& path, const LogSettings& settings);

/// A record as CSV that records_from_csv reads back to the last digit.
std::string record_csv(const Record& record);

}  // namespace solenoid
