#pragma once

// Results of campaigns that nobody could wait for: a real campaign's runs with made-up records, in real shards.

#include "core/config/document.hpp"
#include "experiments/base/files.hpp"
#include "experiments/campaign/results_folder.hpp"
#include "experiments/report/headings.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid::test {

/// A campaign of variants in the members of one ensemble.
inline std::string synthetic_text(const std::vector<std::string>& variants, std::size_t members,
                                  const std::string& sampling = "sobol") {
  return fmt::format(R"(
name = "synthetic"
variants = {}
[[scenario]]
name       = "sine"
trajectory = {{ kind = "sine" }}
plant      = "twin"
noise      = true
[scenario.ensemble]
members  = {}
sampling = "{}"
payload_kg = [0.0, 0.15]
friction = [0.7, 2.0]
flow = [0.8, 1.15]
supply = [0.9, 1.1]
delay = [0.8, 1.25]
inertia = [0.9, 1.1]
noise_factor = [0.5, 2.0]
)",
                     variants, members, sampling);
}

inline Campaign synthetic_campaign(const std::vector<std::string>& variants, std::size_t members) {
  return read_campaign(Document::from_text(synthetic_text(variants, members), "synthetic.toml"));
}

/// A record that might be the run's: errors are spread log-normally about the variant's own, of a thousand runs one has
/// failed and five are unstable. The same run has the same record.
inline KeptRun synthetic_run(const Campaign& campaign, std::size_t index) {
  const CampaignRun run = campaign.runs[index];
  const SystemDescription& system = campaign.system->description();
  std::mt19937_64 random(index + 1);
  const auto share = [&] { return std::uniform_real_distribution<double>()(random); };
  const auto about = [&](double value, double spread) {
    return value * std::exp(spread * std::normal_distribution<double>()(random));
  };
  KeptRun kept{run.hash, {}, about(0.2, 0.1), {}};
  RunRecord& r = kept.record;
  r.variant = campaign.variants[run.variant].name;
  r.scenario = campaign.scenarios.name(run.scenario);
  r.trajectory = "sine";
  r.seed = run.seed;
  r.system = system.name;
  for (std::size_t i = 0; i < system.conditions.size(); ++i) r.conditions.push_back(0.15 * share());
  const double luck = share();
  r.status = luck < 0.001 ? "failed: made up" : luck < 0.006 ? "unstable" : "ok";
  if (!r.ok()) return kept;
  Metrics& m = r.metrics.emplace();
  for (const MetricColumn& metric : system.metrics) {
    const double value = about(metric.whole ? 200.0 : 1.0, 0.3);
    m.set(metric.key, metric.whole ? std::round(value) : value);
  }
  m.set(judged_metric(system).key, about(0.2 + 0.1 * static_cast<double>(run.variant), 0.5));
  const double us = about(40.0, 0.2);
  m.solve_us = {us, 2.0 * us, 4.0 * us, 8.0 * us, 16.0 * us};
  m.deadline_misses = share() < 0.01 ? 3 : 0;
  m.proven_optimal_fraction = 0.5 + 0.5 * share();
  for (int solve = 0; solve < 50; ++solve) kept.solves.add(about(us, 0.5));
  return kept;
}

/// Puts the records of all runs of a campaign into shards below `folder`, as so many processes would have.
inline void write_synthetic(const Campaign& campaign, const std::string& folder, int shards) {
  create_folder(folder + "/shards");
  prepare_for_shards(campaign, folder, shards);
  for (int i = 1; i <= shards; ++i) {
    const Shard shard = Shard::of(i, shards);
    ShardWriter writer(folder + "/shards/" + shard.name(), session_of(campaign));
    for (const std::size_t run : runs_of(campaign, shard)) writer.add(encode_run(synthetic_run(campaign, run)));
  }
}

}  // namespace solenoid::test
