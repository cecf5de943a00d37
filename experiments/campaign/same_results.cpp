#include "experiments/campaign/same_results.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/table.hpp"
#include "experiments/campaign/manifest.hpp"
#include "experiments/campaign/stored_runs.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// A run's record without what differs between any two runs of the same.
Json timeless(const RunRecord& record) {
  Json json = to_json(record);
  json.erase("solve_us");
  json.erase("deadline_misses");
  return json;
}

bool same_traces(const Trace& ours, const Trace& theirs) {
  bool same = ours.ticks == theirs.ticks && ours.signals.size() == theirs.signals.size();
  for (std::size_t i = 0; same && i < ours.signals.size(); ++i)
    same = std::ranges::equal(ours.signals[i].values, theirs.signals[i].values,
                              [](double a, double b) { return a == b || (a != a && b != b); });
  return same;
}

StoredRuns runs_of_folder(const std::string& folder, const Campaign& campaign) {
  StoredRuns runs(folder, campaign, maker_of_folder(folder).value_or(""));
  runs.refresh();
  return runs;
}

}  // namespace

SameResults compare_results_folders(const std::string& expected, const std::string& found, bool whole) {
  if (!std::filesystem::exists(expected + "/resolved.toml")) return {};
  const Campaign campaign = read_campaign(expected + "/resolved.toml", {.loads_plugins = false});
  const StoredRuns ours = runs_of_folder(expected, campaign), theirs = runs_of_folder(found, campaign);
  SameResults out;
  for (std::size_t run = 0; run < ours.size(); ++run) {
    const std::string id = campaign.runs[run].id;
    const auto differs = [&](std::string_view how) { out.differences.push_back(fmt::format("{}{}", id, how)); };
    if (!ours.has(run)) continue;
    if (!theirs.has(run)) {
      if (whole) differs(" is not there");
      continue;
    }
    ++out.records;
    const Json record = timeless(theirs.read(run).record), wanted = timeless(ours.read(run).record);
    const bool done_again = !whole && theirs.ending(run) == StoredRuns::Ending::failed;
    if (record != wanted && !done_again)
      differs(fmt::format(" differs: {} in place of {}", record.dump(), wanted.dump()));
    if (done_again || !ours.traced(run)) continue;
    try {
      ++out.traces;
      const auto trace = theirs.trace(run);
      if (!trace || !same_traces(decode_trace(ours.trace(run).value()), decode_trace(*trace)))
        differs("'s trace differs");
    } catch (const std::exception& error) {
      if (whole) differs(fmt::format("'s trace cannot be read: {}", error.what()));
    }
  }
  return out;
}

}  // namespace solenoid
