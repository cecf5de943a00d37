#pragma once

#include "experiments/systems/actuator/identify/experiment.hpp"
#include "experiments/systems/actuator/identify/run_experiment.hpp"
#include "experiments/systems/actuator/twin/twin_parameters.hpp"

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// The twin of the coverage study: the model's own equations in continuous time, so that its parameters are what the
/// estimators should find, with a flow that is continuous where it chokes, behind the nominal twin's whole noisy
/// sensing chain and with its valves' jitter.
TwinParameters coverage_twin();

/// What identification should find on this twin, by the estimates' names.
std::map<std::string, double> true_values(const TwinParameters& twin, double payload_kg);

struct CoverageSettings {
  TwinParameters twin = coverage_twin();
  std::vector<Experiment> experiments = shipped_experiments();
  ExperimentSettings run;
  std::uint64_t first_seed = 1;
  int seeds = 100;
  int jobs = 1;
};

/// One identified value over the seeds.
struct CoverageRow {
  std::string name, unit;
  double truth = 0;
  double mean = 0;            ///< of the values
  double deviation = 0;       ///< of the values from the truth, root mean square
  double half_width = 0;      ///< of the 95 % intervals, mean
  int runs = 0, covered = 0;  ///< seeds, and those whose interval holds the truth
  int near = 0;               ///< within 5 % of the truth; delays within 0.2 ms
  bool good() const { return 10 * covered >= 9 * runs && 10 * near >= 9 * runs; }
};

struct CoverageStudy {
  std::vector<CoverageRow> rows;
  int seeds = 0, failed = 0;
  bool interrupted = false;
  bool good() const;
};

/// Simulates all experiments and identifies, for each seed in a process of its own.
CoverageStudy study_coverage(const CoverageSettings& settings, const std::function<void(int done)>& progress,
                             const std::function<bool()>& interrupted);

/// A row a value; drawn is the error in per cent of the truth with the interval, and the share that holds the truth.
Result result_of(const CoverageStudy& study);

}  // namespace solenoid
