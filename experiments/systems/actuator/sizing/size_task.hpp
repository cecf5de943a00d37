#pragma once

#include "experiments/systems/actuator/sizing/sizing.hpp"

#include <map>
#include <string>
#include <vector>

namespace solenoid {

class TableReader;

/// A figure as somebody printed it: its digits say how exact it is.
struct PrintedFigure {
  std::string text;
  std::string at;    ///< where: "(3.10)"
  std::string note;  ///< what is to be said where it differs
  double value = 0.0;
  double half_digit() const;  ///< half a unit of the last digit printed
};

/// A task and the figures that were printed for it, by the names of sizing_quantities().
struct SizingInput {
  SizingTask task;
  std::map<std::string, PrintedFigure> printed;
};

/// The task of the thesis with its printed figures, compiled in (experiments/systems/actuator/data/tasks/sizing.toml).
const SizingInput& thesis_sizing();

/// Reads a task's TOML; what it leaves out is the thesis's, but for the bore, which it has none of, and the printed
/// figures, which are only its own. Throws ConfigError with file, line, key and what is allowed.
SizingInput read_sizing_file(const std::string& path);

/// The same task with `KEY=VALUE` settings, KEY dotted as in the file: "arm.payload_kg=1.5". No printed figure stands
/// for another task. Throws ConfigError.
SizingInput with_settings(const SizingInput& input, const std::vector<std::string>& settings);

}  // namespace solenoid
