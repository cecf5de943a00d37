#pragma once

#include "experiments/campaign/stored_runs.hpp"
#include "experiments/campaign/trace.hpp"
#include "experiments/report/run_table.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace solenoid {

/// A run that a results folder keeps.
struct StoredRun {
  std::string id;
  RunRecord record;
  std::optional<std::size_t> index = {};  ///< among Results::kept; none: in files of its own, of the version before
  SolveHistogram solves = {};             ///< as far as they are known without its trace
};

/// Runs up to which a results folder is read with a record of each: beyond it lists, and pages that have them, grow out of
/// hand, at 5 kB a run in memory and 1.5 kB on a page.
inline constexpr std::size_t most_listed_runs = 2000;
/// So many are listed of more, in about 1.5 MB of a page.
inline constexpr std::size_t most_sampled_runs = 1000;

/// How many runs are read one by one.
struct Listing {
  std::size_t most = most_listed_runs;     ///< up to which all of them are
  std::size_t sample = most_sampled_runs;  ///< about so many of more (sampled_rows)

  static Listing everything() { return {static_cast<std::size_t>(-1), 0}; }
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
  Campaign campaign;                      ///< of resolved.toml
  std::shared_ptr<StoredRuns> kept = {};  ///< null: the version before wrote it, a file a run
  std::vector<StoredRun> runs;            ///< by scenario, variant and seed, as far as they are there: all, or a sample
  std::shared_ptr<const RunTable> all_runs = {};  ///< null: `runs` are all of them
  std::vector<LeftOut> left_out;                  ///< by ID
  int unchecked = 0;                              ///< runs that a version before wrote, without checksums

  /// Nothing for a name that is not the campaign's.
  const VariantConfig* variant(const std::string& name) const;
  std::optional<ScenarioConfig> scenario(const std::string& name) const;
  bool sampled() const { return all_runs != nullptr; }
  /// What is ranked, of all runs, listed or not.
  std::shared_ptr<const RunTable> table() const;
  /// Listed or not. Throws ConfigError naming those there are.
  StoredRun run(const std::string& id) const;
};

/// Throws ConfigError naming the key of the manifest, read from the file `name`, that is not as it was written.
void require_manifest(const nlohmann::ordered_json& manifest, const std::string& name);

/// Throws ConfigError naming the file and what is wrong with it, but for runs, which are left out one by one. A folder in
/// which a campaign is still running is fine. Of a version before, every run is listed.
Results read_results(const std::string& folder, const Listing& listing = {});

/// The run over time, from its trace or from the log ID.mcap; none if neither is there. Of a log that was cut as far
/// as it goes, and the rest joins `left_out`. Throws ConfigError for files that are damaged.
std::optional<Trace> read_trace(Results& results, const StoredRun& run);

/// Appends those of `kept` that `wanted` holds for, in the campaign's order; what of them cannot be read joins `left_out`.
void read_kept_runs(Results& results, const std::function<bool(std::size_t run)>& wanted);

}  // namespace solenoid
