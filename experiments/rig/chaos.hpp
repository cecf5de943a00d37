#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// Trouble at random moments, for as long as it is told.
struct ChaosSettings {
  std::string program;  ///< this program's file
  std::string folder;   ///< of everything it writes; on success nothing of it is needed
  std::string variant = "nine_state";
  double duration_s = 60.0;
  std::uint64_t seed = 1;
};

/// What was done, and what came of it.
struct ChaosOutcome {
  std::map<std::string, std::int64_t> strikes;       ///< how often each was done
  std::map<std::string, std::map<int, int>> exits;   ///< of `compare` and `run`: how often with which code
  std::int64_t campaigns = 0;                        ///< finished whole, all their results compared
  std::int64_t results = 0, traces = 0, redone = 0;  ///< compared with the undisturbed ones; of those damaged before
  std::int64_t runs = 0, logs = 0, ticks = 0, reports = 0;  ///< in real time; their logs read, nodes' reports looked at
  double worst_safe_ms = 0.0;                               ///< node: from the last command to safe outputs
  std::vector<std::string> left_out;                        ///< what this machine does not allow
  std::vector<std::string> findings;                        ///< what must not be
};

/// A campaign that is killed, stopped, starved and cut off from its disk until each of its runs is there all the same,
/// again and again, every surviving result compared with an undisturbed one's to the last digit (times of solving
/// aside); and between those a run in real time on an emulated node that fares likewise, whose node must end safe and
/// whose log must be readable. Throws OutputError.
ChaosOutcome chaos(const ChaosSettings& settings, const std::function<bool()>& interrupted,
                   const std::function<void(const std::string&)>& tell);

Result result_of(const ChaosOutcome& outcome);

}  // namespace solenoid
