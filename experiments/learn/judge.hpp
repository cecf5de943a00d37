#pragma once

#include "experiments/learn/learn.hpp"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// Which taught solver is judged, and on what.
struct JudgeTask {
  std::string variant = "nine_policy";  ///< one that was taught; with `network`: its teacher
  std::string network;                  ///< file of a network in place of the variant's
  std::string campaign = "learning";    ///< of which the scenarios named held_out... are taken
  std::size_t states = 20000;           ///< problems recorded in the teacher's closed loops
  int searched_blocks = 2;              ///< before a learned cost from a file
  int passes = 5;                       ///< over the problems: of each the least time counts
  std::function<bool()> interrupted = [] { return false; };
  std::function<void(const std::string&)> tell = [](const std::string&) {};
};

/// One solver on all problems.
struct JudgedSolver {
  std::string name;
  double optimal = 0.0;  ///< share of plans that cost what the optimum does
  double gap_p50 = 0.0, gap_p90 = 0.0, gap_p99 = 0.0, gap_max = 0.0;  ///< cost above the optimum, relative
  double ratio = 1.0;                                                 ///< sum of costs by the sum of optima
  double us_p50 = 0.0, us_p99 = 0.0, us_p999 = 0.0, us_max = 0.0;
  double nodes_mean = 0.0, nodes_p50 = 0.0, nodes_p999 = 0.0, nodes_max = 0.0;
};

/// What was found.
struct JudgeResult {
  JudgeTask task;
  std::string kind;
  std::size_t states = 0;
  std::vector<JudgedSolver>
      solvers;  ///< the search, the taught solver, it without a warm start, the search helped by it
  std::optional<TaughtQuality> learned;  ///< of a learned cost: at the ends of searched blocks
};

/// Nothing if it was interrupted. Throws ConfigError naming option or key.
std::optional<JudgeResult> judge(const JudgeTask& task);

/// For a person and as JSON.
Result result_of(const JudgeResult& result);

}  // namespace solenoid
