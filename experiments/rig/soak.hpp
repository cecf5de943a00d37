#pragma once

#include "core/metrics/metrics.hpp"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// A run in real time on an emulated node for as long as it is told, with other work on the same processors.
struct SoakSettings {
  std::string program;  ///< this program's file
  std::string folder;   ///< of its files
  std::string variant = "nine_state";
  double duration_s = 60.0;
  double overtime_s = 20.0;  ///< to start and to end: then it is killed, which is a finding
  int load = 2;              ///< threads that compute nothing all the while
};

struct SoakOutcome {
  /// At a moment of the run.
  struct Look {
    double time_s = 0.0;
    std::int64_t run_kb = 0, node_kb = 0;  ///< resident
  };
  std::vector<Look> looks;
  int exit_code = -1;
  std::string causes;  ///< why SAFE
  std::int64_t ticks = 0, skipped = 0, late = 0;
  std::int64_t due = 0;           ///< ticks, by the time of the last one
  std::int64_t safe_entries = 0;  ///< its end included; each other re-armed: the machine stood still for long
  std::int64_t safe_slots = 0;    ///< until it was
  Percentiles late_us, tick_us;   ///< how late ticks began; how long they took
  std::vector<std::string> findings;
};

/// Finds memory that grows after the first tenth by more than a log's index does (1 kB a second), ticks that are neither
/// done nor counted as skipped, a median lateness of half a tick and more (ticks are due at multiples of their period
/// since the start, so lateness would add up if the phase were not kept), and an end that is not clean, or that does
/// not come; an interrupted run ends with 130. Throws OutputError, ConfigError.
SoakOutcome soak(const SoakSettings& settings, const std::function<bool()>& interrupted,
                 const std::function<void(const SoakOutcome::Look&)>& tell);

Result result_of(const SoakOutcome& outcome);

}  // namespace solenoid
