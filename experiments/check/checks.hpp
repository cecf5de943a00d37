#pragma once

#include <string>
#include <vector>

namespace solenoid {

/// One thing that `check` looked at.
///
/// result   "ok" | "missing": optional, and not there | "info" | "failed": needed, and wrong
struct Check {
  std::string group, name, result, detail;
};

/// What this program was built with, and the optional parts of the machine it may use, with their Debian packages.
std::vector<Check> check_installation();

/// Cores, and what the real-time executive would be allowed.
std::vector<Check> check_machine();

/// The model against numbers the thesis prints and against itself.
std::vector<Check> check_model();

}  // namespace solenoid
