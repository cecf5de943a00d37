#pragma once

#include "core/metrics/metrics.hpp"
#include "experiments/profile/replay.hpp"

#include <functional>

namespace solenoid {

struct ProfileOptions {
  int core = -1;        ///< to run on; -1: the last one allowed
  int passes = 0;       ///< over all instances of a variant; 0: until its figures settle
  double limit_ms = 1;  ///< a second limit to count misses at, beside the period
  SolverDecorator decorate;
  std::function<bool()> interrupted = [] { return false; };
  std::function<void(int pass, std::size_t settled, std::size_t variants)> progress;
};

/// Solver time of one variant over its instances. Every instance's time is the least of its passes, so that what the
/// machine adds now and then is left out and what the problem costs remains; percentiles are over instances.
struct VariantProfile {
  std::string name;
  std::string fingerprint;  ///< of the instances: times of others say nothing about these
  int passes = 0;
  Percentiles time_us;          ///< phase timing off
  Percentiles timed_us;         ///< phase timing on
  double overhead_percent = 0;  ///< of phase timing: median over instances of on - off, relative to the p50 off
  Percentiles one_pass_us;      ///< of the last pass alone: with what the machine adds
  int misses = 0, limit_misses = 0;
  bool has_phases = false;
  double estimate_us = 0, prepare_us = 0;      ///< medians, a control period
  std::array<double, phase_count> phase_us{};  ///< means over instances
  double other_us = 0;                         ///< in no phase
  Percentiles nodes;
  std::size_t plans_as_recorded = 0;
  double proven_fraction = 0;
  std::optional<CounterValues> counters;  ///< of one pass
  std::vector<double> solve_us;           ///< each instance's time
  std::vector<ReplaySample> samples;      ///< each instance's pass of least time among those with phase timing
  std::vector<std::int64_t> solve_nodes;  ///< each instance's nodes or iterations
  std::vector<std::size_t> histogram;     ///< of solve_us, bins of histogram_edge_us
};

struct Profile {
  std::vector<VariantProfile> variants;
  int core = -1;
  double period_ms = 0;  ///< of control, of the first variant
  double limit_ms = 0;
  std::string counters_missing;  ///< why there are no hardware counters; empty if there are
  bool interrupted = false;
};

/// Replays every variant's instances on one core: a pass to warm up, then passes with phase timing off and on, variant
/// after variant, so that a slow spell of the machine meets all of them. A variant has settled when none of p50, p99,
/// p99.9 and the p50 with timing has fallen by more than 1 % over its last passes; cheap ones go on while others have
/// not.
Profile profile_instances(const InstanceSet& set, const ProfileOptions& options);

/// Lower edge of histogram bin i: five bins a decade from 1 us.
double histogram_edge_us(std::size_t i);

}  // namespace solenoid
