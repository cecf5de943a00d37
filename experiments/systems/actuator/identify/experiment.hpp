#pragma once

#include "core/systems/actuator/parameters.hpp"
#include "experiments/systems/actuator/identify/record.hpp"

#include <optional>
#include <string>
#include <vector>

namespace solenoid {

class TableReader;

enum class ChamberAction { exhaust, fill, blocked, random };

/// A part of an experiment: what is commanded, for how long, and what the samples are called.
struct ExperimentStep {
  std::string label;
  ChamberAction a = ChamberAction::exhaust, b = ChamberAction::exhaust;
  double random_bit_s = 0.02;               ///< of `random`: fill or exhaust, drawn anew each bit; both chambers alike
  double motor_from_n = 0, motor_to_n = 0;  ///< force, linear over the step
  double sine_n = 0, sine_hz = 0;           ///< added to it
  std::optional<double> hold_m;             ///< PD law towards this position, added
  std::optional<double> to_m;               ///< PD law along a line from where the slide is, at speed_m_s; ends there
  double speed_m_s = 0;
  double seconds = 0;                   ///< at most
  std::optional<double> until_moved_m;  ///< ends earlier, once the slide has moved so far
};

/// What to command and what to record, as data: one [[experiment]] table.
struct Experiment {
  std::string name, about;
  std::string prepare;  ///< what the operator does before it
  Plane plane = Plane::horizontal;
  bool loaded = false;  ///< with the payload mounted
  double start_m = 0.055;
  double stiffness = 6000.0, damping = 300.0;  ///< of the PD law [N/m, N s/m]
  int cycles = 1;
  std::vector<ExperimentStep> steps;

  double longest_s() const;
};

/// Reads [[experiment]] tables. Throws ConfigError with file, line, key and what is allowed.
std::vector<Experiment> read_experiments(TableReader& table);
/// The shipped ones, experiments/systems/actuator/data/tasks/identification.toml.
const std::vector<Experiment>& shipped_experiments();
std::vector<Experiment> read_experiments_file(const std::string& path);

}  // namespace solenoid
