#include "experiments/cli/read_log.hpp"

#include <cstdio>

namespace solenoid {

RecordedRun read_log(const std::string& path) {
  RecordedRun run = read_run(path);
  if (!run.problem.empty()) std::fprintf(stderr, "solenoid: %s: %s\n", path.c_str(), run.problem.c_str());
  return run;
}

}  // namespace solenoid
