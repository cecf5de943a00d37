#include "experiments/report/run_table.hpp"

#include "controllers/systems.hpp"
#include "experiments/campaign/ensemble.hpp"
#include "experiments/report/headings.hpp"

#include <algorithm>
#include <functional>
#include <stdexcept>

namespace solenoid {

void SolveSums::add(const SolveSums& other) {
  times.add(other.times);
  late += other.late;
}

std::vector<double> quantiles(std::vector<double> values, std::size_t most) {
  std::ranges::sort(values);
  if (values.size() <= most) return values;
  const std::size_t n = values.size(), last = most - 1;
  for (std::size_t k = 0; k < most; ++k) values[k] = values[std::max<std::size_t>(1, (k * n + last - 1) / last) - 1];
  values.resize(most);
  return values;
}

RunTable::RunTable(const SystemDescription& system) : system_(&system), error_key_(judged_metric(system).key) {
  for (const MetricColumn& effort : effort_metrics(system)) effort_keys_.push_back(effort.key);
}

std::uint32_t RunTable::variant_number(const std::string& name) {
  const auto found = std::ranges::find(variants_, name);
  if (found == variants_.end()) variants_.push_back(name);
  return static_cast<std::uint32_t>(std::ranges::find(variants_, name) - variants_.begin());
}

std::uint32_t RunTable::group_number(const std::string& name, bool ensemble) {
  const auto [at, fresh] = group_numbers_.try_emplace(name, groups_.size());
  if (fresh) {
    groups_.push_back(name);
    group_rows_.emplace_back(scenario_.size(), scenario_.size());  // the row that is being added
    ensemble_.push_back(ensemble);
  }
  return at->second;
}

std::uint32_t RunTable::scenario_number(const std::string& name) {
  if (name == last_scenario_ && !scenario_groups_.empty()) return last_number_;  // runs come by scenarios
  const auto next = static_cast<std::uint32_t>(scenario_groups_.size());
  const std::size_t key = std::hash<std::string>()(name);
  const auto [at, fresh] = scenario_numbers_.try_emplace(key, next);
  if (fresh) {
    scenario_keys_.push_back(key);
    const std::string group = ensemble_name(name);
    scenario_groups_.push_back(group_number(group, group != name));
  }
  last_scenario_ = name;
  return last_number_ = at->second;
}

void RunTable::add(const RunRecord& run, const SolveHistogram& solves) {
  if (&description_of(run) != system_) throw std::invalid_argument("a table of runs has one system's");
  variant_.push_back(variant_number(run.variant));
  scenario_.push_back(scenario_number(run.scenario));
  seed_.push_back(run.seed);
  ending_.push_back(run.ok() ? Ending::ok : run.failed() ? Ending::failed : Ending::unstable);
  const Metrics* m = run.metrics ? &*run.metrics : nullptr;
  error_.push_back(m ? std::max(m->number(error_key_), 1e-12) : 0.0);
  for (const std::string& key : effort_keys_) efforts_.push_back(m ? m->number(key) : 0.0);
  solve_p50_us_.push_back(m ? m->solve_us.p50 : 0.0);
  solve_p99_us_.push_back(m ? m->solve_us.p99 : 0.0);
  const std::uint32_t group = scenario_groups_[scenario_.back()], variant = variant_.back();
  group_rows_[group].second = size();
  if (solves_.size() <= group) solves_.resize(group + 1);
  if (solves_[group].size() <= variant) solves_[group].resize(variant + 1);
  SolveSums& sums = solves_[group][variant];
  sums.times.add(solves);
  if (m) sums.late += m->deadline_misses;
}

void RunTable::reserve(std::size_t runs) {
  variant_.reserve(runs);
  scenario_.reserve(runs);
  seed_.reserve(runs);
  ending_.reserve(runs);
  efforts_.reserve(runs * effort_keys_.size());
  for (std::vector<double>* column : {&error_, &solve_p50_us_, &solve_p99_us_}) column->reserve(runs);
}

std::pair<std::size_t, std::size_t> RunTable::rows(std::optional<std::uint32_t> group) const {
  return group ? group_rows_[*group] : std::pair(std::size_t{0}, size());
}

RunTable::Counts RunTable::counts() const {
  const auto count = [&](Ending ending) { return static_cast<std::size_t>(std::ranges::count(ending_, ending)); };
  return {count(Ending::ok), count(Ending::unstable), count(Ending::failed)};
}

SolveSums RunTable::solves(std::uint32_t variant, std::optional<std::uint32_t> group) const {
  SolveSums sums;
  for (std::uint32_t g = 0; g < solves_.size(); ++g)
    if ((!group || g == *group) && variant < solves_[g].size()) sums.add(solves_[g][variant]);
  return sums;
}

ErrorDistribution RunTable::distribution(std::uint32_t variant, std::optional<std::uint32_t> group,
                                         std::size_t most) const {
  ErrorDistribution found;
  const auto [first, end] = rows(group);
  for (std::size_t row = first; row < end; ++row) {
    if (variant_[row] != variant || (group && this->group(row) != *group)) continue;
    ++found.runs;
    if (ok(row)) found.errors.push_back(error_[row]);
  }
  found.ok = found.errors.size();
  found.errors = quantiles(std::move(found.errors), most);
  return found;
}

RunTable table_of(const StoredRuns& runs, const SystemDescription& system, std::vector<UnreadRun>* unread) {
  RunTable table(system);
  table.reserve(runs.size() - runs.count(StoredRuns::Ending::missing));
  std::vector<UnreadRun> lost =
      for_each_run(runs, [&](std::size_t, const KeptRun& kept) { table.add(kept.record, kept.solves); });
  if (unread) *unread = std::move(lost);
  return table;
}

std::vector<RunTable> tables_of(std::span<const RunRecord> records) {
  std::vector<RunTable> tables;
  for (const RunRecord& r : records) {
    const SystemDescription* system = &description_of(r);
    auto found = std::ranges::find_if(tables, [&](const RunTable& table) { return &table.system() == system; });
    if (found == tables.end()) found = tables.insert(tables.end(), RunTable(*system));
    found->add(r);
  }
  if (tables.empty()) tables.emplace_back(systems().front()->description());
  return tables;
}

}  // namespace solenoid
