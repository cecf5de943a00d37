#pragma once

#include "tests/experiments/program_under_test.hpp"

#include <filesystem>
#include <functional>
#include <string>

namespace solenoid::test {

/// A rig that may stand still for longer than an operator would let it.
inline const char* const patient_limits = "[limits]\nlongest_gap_ms = 1000\n";

/// Whether it was the machine that stood still.
inline bool stood_still(const ProgramRun& run) {
  const std::string said = run.out + run.err;
  const auto has = [&](const char* word) { return said.find(word) != std::string::npos; };
  return has("tick gap") || has("I/O safe");
}

/// A shared machine may stand still for longer than any rig may. The tests' rig allows it a second, which is longer
/// than its operator would; runs that ended in SAFE for standing still all the same say nothing about what a test asks
/// and are made again.
inline ProgramRun undisturbed(const Folder& folder, const std::function<ProgramRun()>& make,
                              const std::function<bool(const ProgramRun&)>& disturbed = stood_still) {
  if (!std::filesystem::exists(folder / "rig.toml")) folder.write("rig.toml", patient_limits);
  ProgramRun run;
  for (int attempt = 0; attempt < 8; ++attempt) {
    std::filesystem::remove_all(folder / "out");
    run = make();
    if (!disturbed(run)) break;
  }
  return run;
}

}  // namespace solenoid::test
