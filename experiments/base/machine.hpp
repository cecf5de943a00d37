#pragma once

#include <string>

namespace solenoid {

/// The computer a result comes from.
struct Machine {
  std::string cpu, kernel, host;
  int cores = 1;  ///< this process may use
};
Machine this_machine();

/// This machine's alone, for names of files that no other machine makes.
std::string machine_name();

/// Of the running program's file, or of the shared object that this is part of: results of another build are other
/// results.
const std::string& program_fingerprint();

/// Local time with offset, ISO 8601.
std::string timestamp();
/// Local time for a folder's name: 20110131-142501.
std::string compact_timestamp();

}  // namespace solenoid
