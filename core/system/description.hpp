#pragma once

#include "core/system/signals.hpp"
#include "core/system/timing.hpp"

#include <array>
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
  std::size_t state = 0;     ///< which of the true states it is
  std::size_t channel = 0;   ///< which of the measured channels shows it
};

/// An output of the system's models: which derivative of which axis it is.
struct OutputSource {
  std::size_t axis = 0;
  int derivative = 0;         ///< 0 the axis itself, 1 its rate, 2 its acceleration
  std::string name{};         ///< of its weight: `cost.position`
  std::string weight_unit{};  ///< "1/m2"
};

/// A number that says how a run went.
struct MetricColumn {
  std::string key;         ///< in files, with its unit: "rmse_mm"
  bool whole = false;      ///< a count
  std::string heading{};   ///< of its column in tables; none: it is in files alone
  bool effort = false;     ///< what control costs: a column of rankings, by its mean, and an axis of their plots
  bool detail = true;      ///< a column of each scenario's table, if it has a heading
  bool best_least = true;  ///< the least of a column is marked there
  std::string meaning{};   ///< in words, where the heading is none: "steady state: mean |error|"
  bool harmonic = false;   ///< runs are pooled by the harmonic mean: a time between events
};

/// How many rungs a degradation ladder has.
inline constexpr int rungs = 5;

/// What of a run stands in a ranking.
struct Judged {
  std::string metric = "rmse";  ///< a metric's key, less being better
  std::string error = "error";  ///< what it is the error of, in sentences: "true position error"
};

/// What everything above the solvers knows of a plant: names, units and how many of each. Records, logs, tables and
/// plots are made from it; whoever needs to know more than this is part of the system.
struct SystemDescription {
  std::string name;     ///< "tank"
  std::string summary;  ///< one line for `list systems`
  std::vector<Signal> states, channels, continuous, beliefs;
  std::vector<MetricColumn> metrics;       ///< of a run, in the order of tables
  Judged judged;                           ///< which of them ranks
  std::vector<Signal> conditions{};        ///< numbers of a scenario that stand in its runs' records
  Signal consumption{};                    ///< of its models; without a name: nothing is consumed
  std::vector<std::string> estimate_keys;  ///< of the estimated states in logs, one each
  std::vector<std::string> decided_keys;   ///< of the continuous inputs before the limits in logs, one each
  std::vector<Axis> axes;
  std::vector<std::string> reference_keys;  ///< in logs: each axis's value, then each one's rate
  std::vector<OutputSource> outputs;        ///< of its models
  Timing timing;                            ///< unless a scenario or variant says otherwise
  std::string switches_key = "switches";    ///< in logs: the pattern of switches that are on
  std::string switch_noun = "switch";       ///< what people call one
  std::string modes_key = "modes";          ///< of a variant: the mode set's name
  /// The rungs of the ladder (core/rt/controller.hpp) in logs.
  std::array<std::string, rungs> rung_names = {"fresh", "shifted", "held", "backup", "safe"};
  /// What ends in SAFE where an axis, or another channel, is beyond its limits.
  std::string axis_limit_name = "axis limit", channel_limit_name = "channel limit";
};

/// A unit as keys write it: "N" is "n", "%" is "percent".
std::string unit_in_keys(std::string unit);

/// The continuous inputs by name, a space between them.
std::string input_names(const SystemDescription& system);

/// Throws std::logic_error, naming what a description lacks or what in it points to nothing: records, logs and tables are
/// made from it without looking again.
void require_complete(const SystemDescription& system);

}  // namespace solenoid
