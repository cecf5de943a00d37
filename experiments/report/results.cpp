#include "experiments/report/results.hpp"

#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/shown_text.hpp"
#include "experiments/campaign/manifest.hpp"
#include "experiments/campaign/run_file.hpp"
#include "experiments/report/sample.hpp"
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

bool has_log(const std::string& folder, const std::string& id) {
  std::error_code ignored;
  return fs::exists(log_of(folder, id), ignored);
}

std::string lacks_log_text(const std::string& folder, const std::string& id) {
  return fmt::format("{}: is missing; no curves (allowed: {})", log_of(folder, id), allowed);
}

/// A run that ended has a trace or a log, but for those of a version before.
bool lacks_log(const std::string& folder, const std::string& id, const RunFile& file) {
  return file.checked && !file.trace && !file.record.failed() && !has_log(folder, id);
}

/// Of the version before: runs/ID.json and runs/ID.trace. Runs, and those that are there but not as they were written, which
/// do not keep the others from being read.
void read_runs_apart(const std::string& folder, Results& results) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder + "/runs", error)) {
    if (entry.path().extension() != ".json") continue;
    const std::string id = entry.path().stem().string();
    try {
      const RunFile file = read_stored_run(folder, id);
      results.runs.push_back({id, file.record});
      results.unchecked += !file.checked;
      if (lacks_log(folder, id, file)) results.left_out.push_back({id, lacks_log_text(folder, id), true});
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

/// Sorts by scenario, variant and seed, in the campaign's order.
void sort_runs(const Campaign& campaign, std::vector<StoredRun>& runs) {
  std::ranges::sort(runs, {}, [&](const StoredRun& run) {
    const RunRecord& r = run.record;
    return std::tuple(campaign.scenarios.find(r.scenario), index_of(campaign.variants, r.variant), r.seed, run.id);
  });
}

/// Those that were run, which a run in real time may be told on the command line.
void take_seeds(Results& results) {
  const auto seeds = results.manifest.find("seeds");
  if (seeds == results.manifest.end() || seeds->empty()) return;
  Campaign& campaign = results.campaign;
  campaign.seeds = seeds->get<std::vector<std::uint64_t>>();
  campaign.runs = campaign.runs.over(campaign.scenarios, campaign.seeds);
}

/// Damage to files that hold many runs: the runs that are missing, where all were there; else the file.
void leave_damage_out(Results& results, const std::string& status) {
  constexpr std::size_t most = 100;
  const std::vector<std::string> damage = results.kept->damage();
  if (damage.empty() || results.kept->count(StoredRuns::Ending::missing) == 0) return;
  std::size_t told = 0;
  for (std::size_t i = 0; status == "finished" && i < results.kept->size() && told < most; ++i) {
    if (results.kept->has(i)) continue;
    const std::string id = results.campaign.runs[i].id;
    results.left_out.push_back({id, fmt::format("{}; {} is missing", damage.front(), id)});
    ++told;
  }
  if (told > 0) return;
  for (const std::string& line : damage) results.left_out.push_back({line.substr(0, line.find(": ")), line, true});
}

/// All runs, or of too many a sample beside the table of all.
void list_runs(Results& results, const Listing& listing) {
  const StoredRuns& kept = *results.kept;
  const std::size_t there = kept.size() - kept.count(StoredRuns::Ending::missing);
  if (there <= listing.most) return read_kept_runs(results, [](std::size_t) { return true; });
  std::vector<std::uint32_t> runs;  // of the table's rows
  runs.reserve(there);
  auto table = std::make_shared<RunTable>(results.campaign.system->description());
  table->reserve(there);
  const std::vector<UnreadRun> unread = for_each_run(kept, [&](std::size_t run, const KeptRun& whole) {
    table->add(whole.record, whole.solves);
    runs.push_back(static_cast<std::uint32_t>(run));
  });
  for (const UnreadRun& run : unread) results.left_out.push_back({results.campaign.runs[run.run].id, run.reason});
  std::vector<bool> wanted(kept.size());
  for (const std::size_t row : sampled_rows(*table, listing.sample)) wanted[runs[row]] = true;
  read_kept_runs(results, [&](std::size_t run) { return wanted[run]; });
  results.all_runs = std::move(table);
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
  const auto at = campaign.scenarios.find(name);
  return at ? std::optional(campaign.scenarios[*at]) : std::nullopt;
}

std::shared_ptr<const RunTable> Results::table() const {
  if (all_runs) return all_runs;
  auto table = std::make_shared<RunTable>(campaign.system->description());
  for (const StoredRun& run : runs) table->add(run.record, run.solves);
  return table;
}

StoredRun Results::run(const std::string& id) const {
  const auto found = std::ranges::find(runs, id, &StoredRun::id);
  if (found != runs.end()) return *found;
  if (const auto at = sampled() ? campaign.runs.find(id) : std::nullopt; at && kept->has(*at)) {
    KeptRun whole = kept->read(*at);
    return {id, std::move(whole.record), *at, std::move(whole.solves)};
  }
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

void read_kept_runs(Results& results, const std::function<bool(std::size_t run)>& wanted) {
  const StoredRuns& kept = *results.kept;
  StoredRuns::Reader reader(kept);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (!kept.has(i) || !wanted(i)) continue;
    const std::string id = results.campaign.runs[i].id;
    try {
      KeptRun whole = reader.read(i);
      StoredRun run{id, std::move(whole.record), i, std::move(whole.solves)};
      if (kept.logged(i) && !run.record.failed() && !has_log(results.folder, id))
        results.left_out.push_back({id, lacks_log_text(results.folder, id), true});
      results.runs.push_back(std::move(run));
    } catch (const ConfigError& problem) {
      results.left_out.push_back({id, problem.what()});
    }
  }
}

Results read_results(const std::string& folder, const Listing& listing) {
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
  if (fs::is_directory(folder + "/shards", ignored)) {
    take_seeds(results);
    results.kept = std::make_shared<StoredRuns>(folder, results.campaign, maker_of(results.manifest).value_or(""));
    results.kept->refresh();
    leave_damage_out(results, results.manifest.value("status", ""));
    list_runs(results, listing);
  } else {
    read_runs_apart(folder, results);
    std::erase_if(results.runs, [&](const StoredRun& run) { return !belongs_to(results, run.record); });
    sort_runs(results.campaign, results.runs);
  }
  return results;
}

std::optional<Trace> read_trace(Results& results, const StoredRun& run) {
  const std::string path =
      run.index ? results.kept->trace_file(*run.index) : results.folder + "/runs/" + run.id + ".trace";
  if (const auto bytes = run.index ? results.kept->trace(*run.index) : read_whole_file(path, file_size::trace)) {
    try {
      return decode_trace(*bytes);
    } catch (const std::invalid_argument& error) {
      throw ConfigError(fmt::format("{}: {} (allowed: a file that `solenoid compare` wrote)", path, error.what()));
    }
  }
  const std::string log = log_of(results.folder, run.id);
  const VariantConfig* variant = results.variant(run.record.variant);
  const std::optional<ScenarioConfig> scenario = results.scenario(run.record.scenario);
  if (!has_log(results.folder, run.id) || !variant || !scenario) return std::nullopt;
  const RecordedRun recorded = read_run(log);
  if (!recorded.problem.empty()) leave_end_out(results, run.id, recorded);
  return make_trace(*variant, *scenario, recorded.ticks);
}

}  // namespace solenoid
