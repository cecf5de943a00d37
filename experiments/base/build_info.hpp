#pragma once

#include <string>

namespace solenoid {

/// What was built, known when the build was configured.
struct BuildInfo {
  std::string version;
  std::string git_revision;  ///< empty outside a git work tree; "-dirty" with uncommitted changes
  std::string compiler;
  std::string build_type;
};
BuildInfo build_info();

}  // namespace solenoid
