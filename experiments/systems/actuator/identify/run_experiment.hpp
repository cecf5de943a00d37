#pragma once

#include "core/rt/io.hpp"
#include "experiments/systems/actuator/identify/experiment.hpp"
#include "experiments/systems/actuator/twin/twin_parameters.hpp"

#include <cstdint>
#include <functional>
#include <string>

namespace solenoid {

/// How experiments are carried out, whatever the plant.
struct ExperimentSettings {
  std::string valves = "two_way";
  double motor_limit_n = 8.0;
  std::uint64_t seed = 1;           ///< of the random sequences and, simulated, of the noise
  double loaded_payload_kg = 0.15;  ///< what is mounted where an experiment is `loaded`
};

/// On the twin, as fast as it goes: each experiment on a plant of its own that stands at its start.
Record simulate_experiment(const Experiment& experiment, const TwinParameters& twin,
                           const ExperimentSettings& settings);

/// On a plant in real time, in a thread of its own at SCHED_FIFO if that is granted. Ends early, with every output
/// safe, when `interrupted` says so or the sensors stay away (std::runtime_error).
Record run_experiment_in_real_time(const Experiment& experiment, Plant& plant, const ExperimentSettings& settings,
                                   const std::function<bool()>& interrupted);

}  // namespace solenoid
