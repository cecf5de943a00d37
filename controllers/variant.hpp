#pragma once

#include "controllers/integral_offset.hpp"
#include "controllers/own_settings.hpp"
#include "core/config/reader.hpp"
#include "core/system/signals.hpp"
#include "core/system/timing.hpp"

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

class System;

/// What a tick may be [ms].
inline const Range tick_range_ms{0.01, 1000.0};
/// What a control period may be [ms].
inline const Range period_range_ms{0.01, 60000.0};

/// Sampling as a variant or scenario has it; what it does not say is the system's own.
struct TimingKeys {
  std::optional<double> tick_ms, period_ms;
  bool operator==(const TimingKeys&) const = default;
};

/// How far the prediction looks and in which blocks a mode is held.
struct HorizonSettings {
  int steps = 100;          ///< N_p, model steps of a tick
  std::vector<int> blocks;  ///< control periods each; empty: one block of all steps
  bool operator==(const HorizonSettings&) const = default;
};

/// Weights of problem.hpp's cost, in the order of the system's outputs and continuous inputs.
struct CostSettings {
  std::array<double, max_states> tracking{1.0}, terminal{};
  double switching = 0.0, consumption = 0.0;
  ContinuousValues continuous{};  ///< on the squared inputs that a joint plan chooses
  bool operator==(const CostSettings&) const = default;
};

/// What plans keep to beside the mode set's own timing: of each switch, and of each state in the order of the system's.
struct LimitSettings {
  std::optional<double> least_on_ms, least_off_ms, window_ms;
  std::array<std::optional<double>, max_states> least{}, most{};
  std::array<double, max_states> penalty{};  ///< on the squared excess, which softens them; 0: hard
  int most_changes = 0;                      ///< of a switch within the window; 0: any number
  bool operator==(const LimitSettings&) const = default;
};

/// How much work a solver that relaxes and rounds puts into a plan.
struct RoundingSettings {
  bool improve = true;  ///< mode swaps and motor re-optimised after rounding
  int iterations = 15;  ///< of the relaxation before rounding
  bool operator==(const RoundingSettings&) const = default;
};

/// How a solver that samples sequences of modes does it (solvers/sampling/mode_sampling.hpp).
struct SamplingSettings {
  int samples = 512;         ///< sequences tried a solve, over all iterations
  int iterations = 4;        ///< updates of the distribution they are drawn from
  double elites = 0.1;       ///< share of the best that the cross-entropy method fits the distribution to
  double temperature = 0.1;  ///< of MPPI's weights, in the spread of an iteration's costs
  double smoothing = 0.3;    ///< share of the distribution before an update that stays in it
  double mutation = 0.3;     ///< probability that a block of a sample flips one switch of its mode
  int seed = 1;              ///< of the draws
  bool operator==(const SamplingSettings&) const = default;
};

/// How a solver of other people's mixed-integer programs goes about it.
struct MinlpSettings {
  std::string algorithm = "branch_and_bound";
  bool operator==(const MinlpSettings&) const = default;
};

/// How a relaxed plan becomes pulses of single steps.
struct ModulationSettings {
  std::string kind = "pulse_width";
  bool informed = false;     ///< the modulator's own state is in the prediction that the inputs are planned by
  double edge_price = 0.05;  ///< of each change, in squared steps that are owed
  bool operator==(const ModulationSettings&) const = default;
};

/// What a solver that was taught has learned, and what it still searches.
struct LearnedSettings {
  std::string network;      ///< a shipped network's name, or a file of one
  int searched_blocks = 2;  ///< blocks of the horizon that are searched before a learned cost-to-go ends the sequence
  bool operator==(const LearnedSettings&) const = default;
};

/// A controller as data: one [variant.NAME] table. Defaults are the system's (new_variant()); what a key means and may be
/// stands in variant_keys.cpp and with the system, which of them a solver or law reads in catalogue.cpp.
struct VariantConfig {
  std::string name;
  std::string summary;             ///< one line for `list`
  const System* system = nullptr;  ///< whose controller it is
  std::string modes;               ///< the mode set's name
  std::string estimator;
  std::string solver = "exhaustive";  ///< or a feedback law
  TimingKeys own_timing;
  Timing timing;                      ///< the system's with `own_timing`, or a scenario's
  int latency_ticks = 0;              ///< from sampling to a plan's taking effect
  std::optional<double> deadline_ms;  ///< budget of one solve; none: to the end
  HorizonSettings horizon;
  CostSettings cost;
  LimitSettings limits;
  RoundingSettings rounding;
  SamplingSettings sampling;
  MinlpSettings minlp;
  ModulationSettings modulation;
  LearnedSettings learned;
  IntegralSettings integral;
  OwnSettings own;                                   ///< what the system alone knows
  std::map<std::string, double, std::less<>> added;  ///< by path: keys of rows that are not the system's own

  bool is_feedback_law() const;  ///< `solver` is a law: switches from the present state alone

  bool operator==(const VariantConfig&) const = default;
};

/// A variant that says nothing but whose it is; none: the first system's.
VariantConfig new_variant(const System* system = nullptr);

/// Reads one variant. Throws ConfigError with file, line, key and what is allowed.
VariantConfig read_variant(TableReader& table, const std::string& name);

/// Reads `{ tick_ms = .., period_ms = .. }`.
TimingKeys read_timing_keys(TableReader& table);

/// A system's sampling with what a table `timing` says in its place. Throws ConfigError with the table's place.
Timing with_keys(Timing timing, const TimingKeys& keys, const std::string& where);

/// The sampling that a variant says, and where it says none that of a scenario.
TimingKeys said_timing(const VariantConfig& variant, const TimingKeys& scenario);

/// The variant as it runs where a scenario has its own sampling: that of the variant itself comes first. Throws
/// ConfigError, `where` being the scenario's timing, if the horizon's blocks do not fit.
VariantConfig timed(VariantConfig variant, const TimingKeys& scenario, const std::string& where);

/// Whether two variants are the same controller, whatever they are called.
bool same_controller(VariantConfig a, VariantConfig b);

}  // namespace solenoid
