#pragma once

#include "core/metrics/metrics.hpp"
#include "core/rt/recorder.hpp"
#include "experiments/campaign/scenario.hpp"

#include <vector>

namespace solenoid {

class SolverWrapper;

/// A finished run.
struct RunResult {
  Metrics metrics;
  std::vector<TickRecord> ticks;
};

/// One run on a fake clock: the control loop of the rig with a simulated plant. The same variant, scenario and seed
/// give the same result to the last bit, solver times aside. Throws ConfigError for impossible combinations.
/// `wrapper` gets at the controller's solver.
RunResult simulate(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                   SolverWrapper* wrapper = nullptr);

}  // namespace solenoid
