#pragma once

#include "experiments/systems/actuator/identify/record.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// The rows of a log as they are in it, times increasing.
struct LogSamples {
  std::vector<double> time, position, a, b, motor;
  std::vector<SwitchPattern> coils;
  std::vector<std::string> labels;  ///< of each row, or none

  std::size_t size() const { return time.size(); }
  void add(double t, double position_m, double pressure_a_pa, double pressure_b_pa, double motor_n,
           SwitchPattern pattern);
};

/// Records of a log, and what a person should know of them.
struct LogRecords {
  std::vector<Record> records;
  std::vector<std::string> told;
};

/// Brings a log to even periods, the commonest step of its times: measurements in straight lines between samples, commands
/// held, from the even time nearest to theirs on. Samples within a quarter of a period of their even times pass untouched;
/// others are told.
///
/// Where more than two samples in a row are missing nobody knows what was commanded and measured: the log is divided
/// there, and no estimator differentiates, filters or predicts across. Parts of fewer than 200 samples are left out. Both
/// are told. `about` is what the records have in common. Throws ConfigError, naming the file, for a log without any part.
LogRecords even_records(const LogSamples& samples, const std::string& path, const Record& about);

}  // namespace solenoid
