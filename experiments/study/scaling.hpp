#pragma once

#include "controllers/systems.hpp"

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// How the search for mode sequences scales: nodes and time against the number of blocks, for each mode set of a system,
/// on states recorded from a closed loop.
struct ScalingOptions {
  const System* system = nullptr;
  int instances = 200;     ///< recorded states a mode set
  std::string model = {};  ///< what is predicted, where the system has several: "hybrid"
  std::string title = {};  ///< of table and plot: "a period a block"
};

/// What a search took over the instances. Branch and bound ends after `solve_cap_ms`; a solve that this stopped counts
/// with what it had taken.
struct SearchFigures {
  double nodes_p50 = 0, nodes_p99 = 0, nodes_max = 0;
  double us_p50 = 0, us_p99 = 0, us_max = 0;
  double proven = 0;  ///< share of the instances
};

/// What is proven, and what is missing of the rest, when the search is given this deadline.
struct DeadlineFigures {
  double deadline_ms = 0;
  double proven = 0;  ///< share of the instances
  int open = 0;       ///< instances not proven; their gaps (cost - bound) / cost:
  double gap_p50 = 0, gap_p90 = 0, gap_max = 0;
};

/// One mode set with one number of blocks.
struct ScalingRow {
  std::string mode_set;
  int states = 0;
  std::vector<int> periods;                  ///< blocks, in control periods
  double leaves = 0;                         ///< sequences
  double full_tree = 0;                      ///< nodes of the whole tree
  std::optional<SearchFigures> enumeration;  ///< where there are at most `most_enumerated` sequences
  SearchFigures cold, warm;
  std::vector<DeadlineFigures> deadlines;  ///< of the warm search
};

inline constexpr double most_enumerated = 1e5;
inline constexpr double solve_cap_ms = 50.0;
inline constexpr int most_blocks = 8;

/// Deadlines, in control periods.
inline constexpr std::array deadline_shares = {0.05, 0.1, 0.2, 0.5, 1.0};

/// Runs the study on one processor core, on the first scenario of the shipped campaign of the system's name: blocks of
/// one period each, so the horizon grows with them. `progress` is told of each row begun, `stop` asked between solves; once it
/// says so, the rows finished so far are returned.
std::vector<ScalingRow> study_scaling(const ScalingOptions& options,
                                      const std::function<void(const std::string&)>& progress,
                                      const std::function<bool()>& stop);

/// Nodes and times, then what is proven by each deadline. JSON: {"system", "model", "instances", "solve_cap_ms",
/// "cpu", "rows": [{mode set under the system's key for it, states, blocks, periods, sequences, full_tree, enumeration | null, cold, warm: {nodes_p50,
/// nodes_p99, nodes_max, us_p50, us_p99, us_max, proven}, deadlines: [{deadline_ms, proven, open, gap_p50, gap_p90,
/// gap_max}]}]}. A gap of no instance is null. CSV: a line a row with the same numbers. Drawn are times, nodes and
/// shares proven over the blocks, a column a mode set.
Result result_of(const ScalingOptions& options, std::span<const ScalingRow> rows);

}  // namespace solenoid
