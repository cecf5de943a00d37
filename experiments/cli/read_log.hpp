#pragma once

#include "experiments/rig/log/recorded_run.hpp"

#include <string>

namespace solenoid {

/// read_run for a person: what the log lacks is said on standard error, and what it has is used.
RecordedRun read_log(const std::string& path);

}  // namespace solenoid
