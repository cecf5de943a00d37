#pragma once

#include "core/system/signals.hpp"
#include "core/system/timing.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// One quantity of a system, as people and files name it.
struct Signal {
  std::string name;   ///< "pressure_a": in keys, fault scripts and traces
  std::string unit;   ///< "Pa", SI
  std::string key;    ///< in logs: "pressure_a_pa"
  std::string label;  ///< in sentences: "pressure A"
  std::string meaning{};
};

/// A quantity that a task gives a desired motion to.
struct Axis {
  Signal signal;             ///< its unit is the motion's
  std::string shown_unit;    ///< in which people read it: "mm"
  double shown_scale = 1.0;  ///< of them in one of the unit: 1e3
  std::string rate_label;    ///< in sentences: "velocity"
  std::string offset_key;    ///< in logs, of the integral offset: "offset_m"
  double approach = 0.05;    ///< how fast a task that begins anew moves to its start, on average at most [unit/s]
};

/// An output of the system's models: which derivative of which axis it is.
struct OutputSource {
  std::size_t axis = 0;
  int derivative = 0;  ///< 0 the axis itself, 1 its rate, 2 its acceleration
};

/// A number that says how a run went.
struct MetricColumn {
  std::string key;     ///< in files, with its unit: "rmse_mm"
  bool whole = false;  ///< a count
};

/// What everything above the solvers knows of a plant: names, units and how many of each. Records, logs, tables and
/// plots are made from it; whoever needs to know more than this is part of the system.
struct SystemDescription {
  std::string name;     ///< "tank"
  std::string summary;  ///< one line for `list systems`
  std::vector<Signal> states, channels, continuous, beliefs;
  std::vector<MetricColumn> metrics;       ///< of a run, in the order of tables
  std::vector<std::string> estimate_keys;  ///< of the estimated states in logs
  std::vector<std::string> decided_keys;   ///< of the continuous inputs before the limits, in logs
  std::vector<Axis> axes;
  std::vector<std::string> reference_keys;  ///< in logs: each axis's value, then each one's rate
  std::vector<OutputSource> outputs;        ///< of its models
  Timing timing;                            ///< unless a scenario or variant says otherwise
  std::string switches_key = "switches";    ///< in logs: the pattern of switches that are on
  std::string switch_noun = "switch";       ///< what people call one
};

}  // namespace solenoid
