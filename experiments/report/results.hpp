#pragma once

#include "experiments/campaign/run_record.hpp"
#include "experiments/campaign/trace.hpp"

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace solenoid {

/// A run that a results folder keeps.
struct StoredRun {
  std::string id;
  RunRecord record;
};

/// A run whose files are there and not as they were written, and why: one line that names the file.
struct LeftOut {
  std::string id, reason;
  bool in_part = false;  ///< the run is there, and its curves are not, or end early
};

/// A results folder of `compare` or `run`, read back.
struct Results {
  std::string folder;
  nlohmann::ordered_json manifest;
  Campaign campaign;              ///< of resolved.toml
  std::vector<StoredRun> runs;    ///< by scenario, variant and seed, as far as they are there
  std::vector<LeftOut> left_out;  ///< by ID
  int unchecked = 0;              ///< runs that a version before wrote, without checksums

  /// Nothing for a name that is not the campaign's.
  const VariantConfig* variant(const std::string& name) const;
  std::optional<ScenarioConfig> scenario(const std::string& name) const;
  /// Throws ConfigError naming those there are.
  const StoredRun& run(const std::string& id) const;
};

/// Throws ConfigError naming the key of the manifest, read from the file `name`, that is not as it was written.
void require_manifest(const nlohmann::ordered_json& manifest, const std::string& name);

/// Throws ConfigError naming the file and what is wrong with it, but for runs, which are left out one by one. A folder in which a campaign is still running is fine.
Results read_results(const std::string& folder);

/// The run over time, from runs/ID.trace or from the log ID.mcap; none if neither is there. Of a log that was cut as far
/// as it goes, and the rest joins `left_out`. Throws ConfigError for files that are damaged.
std::optional<Trace> read_trace(Results& results, const StoredRun& run);

/// Sorts by scenario, variant and seed, in the campaign's order.
void sort_runs(const Campaign& campaign, std::vector<StoredRun>& runs);

}  // namespace solenoid
