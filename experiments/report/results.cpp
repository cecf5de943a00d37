#include "experiments/report/results.hpp"

#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/shown_text.hpp"
#include "experiments/campaign/run_file.hpp"
#include "experiments/rig/log/recorded_run.hpp"

#include <algorithm>
#include <filesystem>
#include <tuple>

#include <fmt/format.h>

namespace solenoid {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* allowed = "a results folder of `solenoid compare` or `solenoid run`";

Json read_json(const std::string& path, std::size_t most_bytes) {
  const auto text = read_whole_file(path, most_bytes);
  if (!text) throw ConfigError(fmt::format("{}: cannot be read (allowed: {})", path, allowed));
  return parse_json(*text, path, allowed);
}

template <class T>
std::size_t index_of(const std::vector<T>& configs, const std::string& name) {
  const auto found = std::ranges::find(configs, name, &T::name);
  return static_cast<std::size_t>(found - configs.begin());
}

template <class T>
const T* find(const std::vector<T>& configs, const std::string& name) {
  const std::size_t i = index_of(configs, name);
  return i < configs.size() ? &configs[i] : nullptr;
}

std::string log_of(const std::string& folder, const std::string& id) { return fmt::format("{}/{}.mcap", folder, id); }

/// Throws ConfigError naming the file unless the run is whole and of that name.
RunFile read_stored_run(const std::string& folder, const std::string& id) {
  const std::string path = fmt::format("{}/runs/{}.json", folder, id);
  const auto file = read_run_file(path);
  if (!file) throw ConfigError(fmt::format("{}: cannot be read (allowed: {})", path, allowed));
  const RunRecord& record = file->record;
  if (const std::string named = run_id(record.scenario, record.variant, record.seed); named != id)
    throw ConfigError(fmt::format("{}: is of the run {} (allowed: a file named as its run)", path, shown(named)));
  require_trace(*file, fmt::format("{}/runs/{}.trace", folder, id));
  return *file;
}

/// A run that ended has a trace or a log, but for those of a version before.
bool lacks_log(const std::string& folder, const std::string& id, const RunFile& file) {
  std::error_code ignored;
  return file.checked && !file.trace && !file.record.failed() && !fs::exists(log_of(folder, id), ignored);
}

/// Runs, and those that are there but not as they were written, which do not keep the others from being read.
void read_runs(const std::string& folder, Results& results) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder + "/runs", error)) {
    if (entry.path().extension() != ".json") continue;
    const std::string id = entry.path().stem().string();
    try {
      const RunFile file = read_stored_run(folder, id);
      results.runs.push_back({id, file.record});
      results.unchecked += !file.checked;
      if (lacks_log(folder, id, file))
        results.left_out.push_back(
            {id, fmt::format("{}: is missing; no curves (allowed: {})", log_of(folder, id), allowed), true});
    } catch (const ConfigError& problem) {
      results.left_out.push_back({id, problem.what()});
    }
  }
  if (error) throw ConfigError(fmt::format("{}/runs: {} (allowed: {})", folder, error.message(), allowed));
  std::ranges::sort(results.left_out, {}, &LeftOut::id);
}

bool is_seed(const Json& value) { return value.is_number_unsigned(); }

/// A folder may still hold runs of a campaign that it was used for before.
bool belongs_to(const Results& results, const RunRecord& record) {
  const auto seeds = results.manifest.find("seeds");
  const bool known_seed =
      seeds == results.manifest.end() || std::ranges::find(*seeds, Json(record.seed)) != seeds->end();
  const bool known_system = &description_of(record) == &results.campaign.system->description();
  return known_system && known_seed && results.variant(record.variant) &&
         results.campaign.scenarios.find(record.scenario);
}

/// Once, however often the log is read.
void leave_end_out(Results& results, const std::string& id, const RecordedRun& log) {
  if (std::ranges::count(results.left_out, id, &LeftOut::id) > 0) return;
  const double end_s = log.ticks.back().sensors.time_s;
  results.left_out.push_back(
      {id, fmt::format("{}: {}; shown up to {:.3f} s (allowed: a log that was closed)", log.path, log.problem, end_s),
       true});
}

}  // namespace

const VariantConfig* Results::variant(const std::string& name) const { return find(campaign.variants, name); }
std::optional<ScenarioConfig> Results::scenario(const std::string& name) const {
  const auto i = campaign.scenarios.find(name);
  return i ? std::optional(campaign.scenarios[*i]) : std::nullopt;
}

const StoredRun& Results::run(const std::string& id) const {
  const auto found = std::ranges::find(runs, id, &StoredRun::id);
  if (found != runs.end()) return *found;
  if (const auto out = std::ranges::find(left_out, id, &LeftOut::id); out != left_out.end())
    throw ConfigError(out->reason);
  constexpr std::size_t most = 12;
  std::string known;
  for (std::size_t i = 0; i < std::min(runs.size(), most); ++i) known += (i ? ", " : "") + runs[i].id;
  if (runs.size() > most) known += fmt::format(" and {} more", runs.size() - most);
  throw ConfigError(fmt::format("{}: no run '{}' (allowed: {})", folder, id, known));
}

void require_manifest(const Json& manifest, const std::string& name) {
  if (!manifest.is_object() || !manifest.contains("campaign"))
    throw ConfigError(fmt::format("{}: key 'campaign' is missing (allowed: {})", name, allowed));
  for (const char* key : {"campaign", "status", "started", "ended"})
    if (manifest.contains(key) && !manifest.at(key).is_string())
      throw ConfigError(fmt::format("{}: key '{}': wrong type (allowed: a text)", name, key));
  const auto seeds = manifest.find("seeds");
  if (seeds != manifest.end() && !(seeds->is_array() && std::ranges::all_of(*seeds, is_seed)))
    throw ConfigError(fmt::format("{}: key 'seeds': wrong type (allowed: a list of whole numbers from 0)", name));
}

void sort_runs(const Campaign& campaign, std::vector<StoredRun>& runs) {
  std::ranges::sort(runs, {}, [&](const StoredRun& run) {
    return std::tuple(campaign.scenarios.find(run.record.scenario).value_or(campaign.scenarios.size()),
                      index_of(campaign.variants, run.record.variant), run.record.seed, run.id);
  });
}

Results read_results(const std::string& folder) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored))
    throw ConfigError(fmt::format("{}: no folder (allowed: {})", folder, allowed));
  Results results;
  results.folder = folder;
  results.manifest = read_json(folder + "/manifest.json", file_size::json);
  require_manifest(results.manifest, folder + "/manifest.json");
  const std::string resolved = folder + "/resolved.toml";
  if (!fs::is_regular_file(resolved, ignored))
    throw ConfigError(fmt::format("{}: is missing (allowed: {})", resolved, allowed));
  results.campaign = read_campaign(resolved, {.loads_plugins = false});
  read_runs(folder, results);
  std::erase_if(results.runs, [&](const StoredRun& run) { return !belongs_to(results, run.record); });
  sort_runs(results.campaign, results.runs);
  return results;
}

std::optional<Trace> read_trace(Results& results, const StoredRun& run) {
  const std::string path = results.folder + "/runs/" + run.id + ".trace";
  if (const auto bytes = read_whole_file(path, file_size::trace)) {
    try {
      return decode_trace(*bytes);
    } catch (const std::invalid_argument& error) {
      throw ConfigError(fmt::format("{}: {} (allowed: a file that `solenoid compare` wrote)", path, error.what()));
    }
  }
  const std::string log = log_of(results.folder, run.id);
  const VariantConfig* variant = results.variant(run.record.variant);
  const std::optional<ScenarioConfig> scenario = results.scenario(run.record.scenario);
  std::error_code ignored;
  if (!fs::exists(log, ignored) || !variant || !scenario) return std::nullopt;
  const RecordedRun recorded = read_run(log);
  if (!recorded.problem.empty()) leave_end_out(results, run.id, recorded);
  return make_trace(*variant, *scenario, recorded.ticks);
}

}  // namespace solenoid
