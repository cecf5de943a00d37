#pragma once

#include "experiments/study/scaling.hpp"

#include <span>
#include <string>

namespace solenoid {

/// {"model", "switching", "instances", "solve_cap_ms", "cpu", "rows": [{valves, states, blocks, periods, sequences,
/// full_tree, enumeration | null, cold, warm: {nodes_p50, nodes_p99, nodes_max, us_p50, us_p99, us_max, proven},
/// deadlines: [{deadline_ms, proven, open, gap_p50, gap_p90, gap_max}]}]}. A gap of no instance is null.
std::string scaling_json(const ScalingOptions& options, std::span<const ScalingRow> rows);

/// One line a row with the same figures; those that are not there are empty.
std::string scaling_csv(std::span<const ScalingRow> rows);

/// For a person: nodes and times, then what is proven by each deadline.
std::string scaling_text(const ScalingOptions& options, std::span<const ScalingRow> rows);

enum class ScalingFigureFormat { svg, png };

/// Times, nodes and shares proven over the blocks, a column a valve set. `path` is written whole or not at all. Throws
/// OutputError if it cannot be written, ConfigError if gnuplot is not installed.
void draw_scaling(const ScalingOptions& options, std::span<const ScalingRow> rows, const std::string& path,
                  ScalingFigureFormat format);

}  // namespace solenoid
