#pragma once

#include "core/mpc/mode_set.hpp"
#include "core/systems/actuator/parameters.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// A labelled part of a record: samples [first, last).
struct Span {
  std::string label;
  std::size_t first = 0, last = 0;
};

/// What was commanded and measured, evenly sampled, whatever the source: the twin, a rig, a log. coils[k] and
/// motor_n[k] hold from sample k to the next.
struct Record {
  std::string name;  ///< of the experiment or the log
  int part = 1;      ///< of a log that gaps divide: which part of it
  Plane plane = Plane::horizontal;
  double payload_kg = 0.0;  ///< mounted, as the operator states it; estimators only ask whether there is one
  std::string valves = "two_way";
  double period_s = 0.001;
  std::vector<double> position_m, pressure_a_pa, pressure_b_pa, motor_n;
  std::vector<SwitchPattern> coils;
  std::vector<Span> spans;
  std::size_t filled = 0;  ///< samples that were not measured and repeat the one before

  std::size_t size() const { return position_m.size(); }
  /// The name, told from those of the log's other parts.
  std::string part_name() const { return part == 1 ? name : name + "_" + std::to_string(part); }
  double duration_s() const { return period_s * static_cast<double>(size()); }
};

}  // namespace solenoid
