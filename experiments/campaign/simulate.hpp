#pragma once

#include "controllers/any_solver.hpp"
#include "core/metrics/metrics.hpp"
#include "core/rt/recorder.hpp"
#include "experiments/campaign/scenario.hpp"

#include <vector>

namespace solenoid {

/// A finished run.
struct RunResult {
  Metrics metrics;
  std::vector<TickRecord> ticks;
};

/// One run on a fake clock: the control loop of the rig with a simulated plant. The same variant, scenario and seed
/// give the same result to the last bit, solver times aside. Throws ConfigError for impossible combinations, and what
/// fail_run() (run_in_progress.hpp) was told.
/// `decorate` gets the controller's solver first.
RunResult simulate(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                   const SolverDecorator& decorate = {});

}  // namespace solenoid
