#include "experiments/campaign/same_results.hpp"

#include "experiments/base/bounded_json.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/table.hpp"
#include "experiments/campaign/trace.hpp"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// A run's record without what differs between any two runs of the same.
Json timeless(const std::string& text) {
  Json json = parse_json(text, "a result").at("run");
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

}  // namespace

SameResults compare_results_folders(const std::string& expected, const std::string& found, bool whole,
                                    const std::set<std::string>& left_out) {
  SameResults out;
  for (const auto& entry : std::filesystem::directory_iterator(expected + "/runs")) {
    const std::string name = entry.path().filename();
    if (left_out.contains(name)) continue;
    const auto differs = [&](std::string_view how) { out.differences.push_back(fmt::format("{}{}", name, how)); };
    const auto text = read_whole_file(fmt::format("{}/runs/{}", found, name));
    if (!text) {
      if (whole) differs(" is not there");
      continue;
    }
    try {
      const std::string ours = read_whole_file(entry.path()).value();
      if (entry.path().extension() == ".trace") {
        ++out.traces;
        if (!same_traces(decode_trace(ours), decode_trace(*text))) differs(" differs");
        continue;
      }
      ++out.records;
      const Json record = timeless(*text);
      const bool done_again = !whole && record.value("status", "").starts_with("failed");
      if (record != timeless(ours) && !done_again)
        differs(fmt::format(" differs: {} in place of {}", record.dump(), timeless(ours).dump()));
    } catch (const std::exception& error) {
      differs(fmt::format(" cannot be read: {}", error.what()));
    }
  }
  return out;
}

}  // namespace solenoid
