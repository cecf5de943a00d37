#include "experiments/report/task_errors.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {
namespace {

/// Places of the table's scenarios that have rows, in the order of their keys; of others, none.
std::vector<std::uint32_t> places_of(const RunTable& runs, const std::vector<std::size_t>& rows, std::size_t& count) {
  std::vector<std::uint32_t> present;
  std::vector<bool> seen(runs.scenarios());
  for (const std::size_t row : rows) {
    const std::uint32_t scenario = runs.scenario(row);
    if (!seen[scenario]) present.push_back(scenario);
    seen[scenario] = true;
  }
  std::ranges::sort(present, {}, [&](std::uint32_t scenario) { return runs.scenario_key(scenario); });
  std::vector<std::uint32_t> places(runs.scenarios());
  for (std::uint32_t i = 0; i < present.size(); ++i) places[present[i]] = i;
  count = present.size();
  return places;
}

}  // namespace

TaskErrors::TaskErrors(const RunTable& runs, std::optional<std::uint32_t> group) : variants_(runs.variants().size()) {
  std::vector<std::size_t> rows;
  const auto [first, end] = runs.rows(group);
  for (std::size_t row = first; row < end; ++row)
    if (!group || runs.group(row) == *group) rows.push_back(row);
  const std::vector<std::uint32_t> places = places_of(runs, rows, scenarios_);
  // Rows by scenario, counted; then those of each by seed.
  std::vector<std::size_t> ends(scenarios_ + 1);
  for (const std::size_t row : rows) ++ends[places[runs.scenario(row)] + 1];
  for (std::size_t s = 0; s < scenarios_; ++s) ends[s + 1] += ends[s];
  std::vector<std::size_t> sorted(rows.size()), next(ends.begin(), ends.end() - 1);
  for (const std::size_t row : rows) sorted[next[places[runs.scenario(row)]]++] = row;
  const auto seed = [&](std::size_t row) { return runs.seed(row); };
  for (std::size_t s = 0; s < scenarios_; ++s) {
    const auto begin = sorted.begin() + static_cast<std::ptrdiff_t>(ends[s]);
    const auto stop = sorted.begin() + static_cast<std::ptrdiff_t>(ends[s + 1]);
    if (!std::ranges::is_sorted(begin, stop, {}, seed)) std::ranges::stable_sort(begin, stop, {}, seed);
    for (auto at = begin; at != stop; ++at) {
      if (at == begin || seed(*at) != seed(*(at - 1))) {
        scenario_.push_back(static_cast<std::uint32_t>(s));
        errors_.resize(errors_.size() + variants_, -1.0);
      }
      const bool ended_well = runs.ok(*at) && std::isfinite(runs.error(*at));
      errors_[errors_.size() - variants_ + runs.variant(*at)] = ended_well ? runs.error(*at) : 0.0;
    }
  }
}

}  // namespace solenoid
