#pragma once

#include "experiments/campaign/run_record.hpp"
#include "experiments/rig/session.hpp"

#include <span>
#include <string>

namespace solenoid {

/// One line for a person while a run is under way.
std::string status_line(const TickRecord& tick, const SystemDescription& system);
/// What the operating system granted, a line each.
std::string setup_text(std::span<const SetupStep> setup);
/// How one run ended: metrics, timing, ladder, log.
std::string session_text(const RunRecord& record, const SessionResult& result);
/// Mean and standard deviation over repeats of one run.
std::string repeats_text(std::span<const RunRecord> records);
/// The run's object as `compare` prints it, and `timing`, `ladder`, `loop`, `log`, `setup`.
nlohmann::ordered_json session_json(const RunRecord& record, const SessionResult& result);

}  // namespace solenoid
