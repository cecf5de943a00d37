#include "experiments/report/ranking.hpp"

#include "experiments/report/headings.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

namespace solenoid {
namespace {

using Names = std::set<std::string>;

/// Scenarios where every run of the variant ended well.
Names finished_scenarios(std::span<const RunRecord> records, const std::string& variant) {
  Names seen, troubled, finished;
  for (const RunRecord& r : records)
    if (r.variant == variant) (r.ok() ? seen : troubled).insert(r.scenario);
  std::set_difference(seen.begin(), seen.end(), troubled.begin(), troubled.end(),
                      std::inserter(finished, finished.end()));
  return finished;
}

Names common_to_all(const std::map<std::string, Names>& finished) {
  Names common;
  bool first = true;
  for (const auto& [variant, scenarios] : finished) {
    Names kept;
    std::set_intersection(scenarios.begin(), scenarios.end(), common.begin(), common.end(),
                          std::inserter(kept, kept.end()));
    common = first ? scenarios : kept;
    first = false;
  }
  return common;
}

/// Leaves the variants that are worth comparing in `finished`; returns their common scenarios.
Names choose(std::map<std::string, Names>& finished) {
  std::size_t most = 0;
  for (const auto& [variant, scenarios] : finished) most = std::max(most, scenarios.size());
  std::erase_if(finished, [&](const auto& entry) { return entry.second.empty() || 2 * entry.second.size() < most; });
  Names common = common_to_all(finished);
  while (common.empty() && !finished.empty()) {
    finished.erase(std::min_element(finished.begin(), finished.end(),
                                    [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); }));
    common = common_to_all(finished);
  }
  return common;
}

/// Geometric mean with its interval, 95th percentile and worst.
void summarise_errors(const std::vector<double>& errors, RankedVariant& v) {
  const auto n = static_cast<double>(errors.size());
  const GeometricMean mean = geometric_mean(errors);
  v.error = mean.value;
  v.margin = mean.margin;
  std::vector<double> sorted = errors;
  std::ranges::sort(sorted);
  v.p95 = sorted[static_cast<std::size_t>(std::ceil(0.95 * n)) - 1];
  v.worst = sorted.back();
}

void summarise(std::span<const RunRecord> records, const SystemDescription& system, const Names& common,
               RankedVariant& v) {
  const std::vector<MetricColumn> efforts = effort_metrics(system);
  v.efforts.assign(efforts.size(), 0.0);
  std::vector<double> errors, medians;
  for (const RunRecord& r : records) {
    if (r.variant != v.variant || !r.metrics || !common.contains(r.scenario)) continue;
    const Metrics& m = *r.metrics;
    errors.push_back(std::max(m.number(judged_metric(system).key), 1e-12));
    for (std::size_t i = 0; i < efforts.size(); ++i) v.efforts[i] += m.number(efforts[i].key);
    v.solve_p99_us = std::max(v.solve_p99_us, m.solve_us.p99);
    medians.push_back(m.solve_us.p50);
  }
  summarise_errors(errors, v);
  for (double& effort : v.efforts) effort /= static_cast<double>(errors.size());
  v.solve_p50_us = percentiles(medians).p50;
}

/// Ranks records that are all of one system.
Ranking rank_of_system(std::span<const RunRecord> records, const SystemDescription& system) {
  std::map<std::string, Names> finished;
  Names scenarios;
  Ranking ranking;
  ranking.system = &system;
  for (const RunRecord& r : records) {
    scenarios.insert(r.scenario);
    if (finished.contains(r.variant)) continue;
    finished[r.variant] = finished_scenarios(records, r.variant);
    ranking.variants.emplace_back().variant = r.variant;
  }
  const Names common = choose(finished);
  for (RankedVariant& v : ranking.variants) {
    for (const RunRecord& r : records) {
      if (r.variant != v.variant) continue;
      ++v.runs;
      v.failed += r.failed();
      v.unstable += !r.failed() && !r.ok();
    }
    v.ranked = finished.contains(v.variant);
    if (v.ranked) summarise(records, system, common, v);
  }
  std::stable_sort(ranking.variants.begin(), ranking.variants.end(), [](const auto& a, const auto& b) {
    return a.ranked != b.ranked ? a.ranked : a.ranked && a.error < b.error;
  });
  ranking.common_scenarios = common.size();
  ranking.scenarios = scenarios.size();
  return ranking;
}

}  // namespace

GeometricMean geometric_mean(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  double sum = 0, squares = 0;
  for (const double e : values) sum += std::log(e);
  for (const double e : values) squares += (std::log(e) - sum / n) * (std::log(e) - sum / n);
  return {std::exp(sum / n), values.size() > 1 ? std::exp(1.96 * std::sqrt(squares / (n - 1) / n)) : 1.0};
}

std::vector<std::vector<RunRecord>> by_system(std::span<const RunRecord> records) {
  std::vector<std::vector<RunRecord>> parts;
  for (const RunRecord& r : records) {
    const auto same = [&](const std::vector<RunRecord>& part) {
      return &description_of(part.front()) == &description_of(r);
    };
    const auto found = std::ranges::find_if(parts, same);
    (found == parts.end() ? parts.emplace_back() : *found).push_back(r);
  }
  return parts;
}

Ranking rank_variants(std::span<const RunRecord> records) {
  const SystemDescription& system = description_of(records.empty() ? RunRecord{} : records.front());
  const auto own = [&](const RunRecord& r) { return &description_of(r) == &system; };
  if (std::ranges::all_of(records, own)) return rank_of_system(records, system);
  return rank_of_system(by_system(records).front(), system);
}

}  // namespace solenoid
