#pragma once

#include "core/rt/recorder.hpp"
#include "core/system/description.hpp"

#include <map>
#include <string>
#include <vector>

namespace solenoid {

/// A log of `solenoid run`, read back.
struct RecordedRun {
  std::string path;
  const SystemDescription* system = nullptr;
  std::map<std::string, std::string> about, summary;
  std::vector<TickRecord> ticks;
  std::vector<std::string> events;  ///< "TIME KIND TEXT"
  std::string problem;              ///< why the log is not complete; empty for one that was closed
};

/// Reads as far as the file goes; times increase, and every number is one that a tick may have. Throws ConfigError,
/// naming the file, the tick and its byte, if it is no such log or has no ticks.
RecordedRun read_run(const std::string& path);

}  // namespace solenoid
