#pragma once

// Records of runs that have an error and nothing else to tell.

#include "controllers/systems.hpp"
#include "experiments/campaign/run_record.hpp"

#include <string>
#include <vector>

namespace solenoid::test {

/// A run of the first system with this judged error; not above 0: it failed.
inline RunRecord judged_run(const std::string& variant, const std::string& scenario, std::uint64_t seed, double error) {
  const SystemDescription& system = systems().front()->description();
  RunRecord r;
  r.variant = variant;
  r.scenario = scenario;
  r.seed = seed;
  r.status = error > 0 ? "ok" : "failed: made up";
  if (error <= 0) return r;
  r.metrics.emplace();
  for (const MetricColumn& metric : system.metrics) r.metrics->set(metric.key, 1.0);
  r.metrics->set(system.judged.metric, error);
  return r;
}

/// Of each variant, "v0" and on, an error in each scenario, "s0" and on: errors[variant][scenario].
inline std::vector<RunRecord> judged_runs(const std::vector<std::vector<double>>& errors) {
  std::vector<RunRecord> records;
  for (std::size_t s = 0; s < errors.front().size(); ++s)
    for (std::size_t v = 0; v < errors.size(); ++v)
      records.push_back(judged_run("v" + std::to_string(v), "s" + std::to_string(s), 1, errors[v][s]));
  return records;
}

}  // namespace solenoid::test
