#include "experiments/report/report_data.hpp"

#include "controllers/systems.hpp"
#include "experiments/base/build_info.hpp"
#include "experiments/campaign/ensemble.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/report/against.hpp"
#include "experiments/report/headings.hpp"
#include "experiments/report/ranking.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

/// Names of a ranking's figures in the JSON: "rmse_mm", "rmse_margin", "p95_rmse_mm", "worst_rmse_mm".
struct JudgedKeys {
  std::string error, margin, p95, worst;
};

JudgedKeys judged_keys(const SystemDescription& system) {
  const std::string& key = judged_metric(system).key;
  return {key, key.substr(0, key.rfind('_')) + "_margin", "p95_" + key, "worst_" + key};
}

Json metric_json(const MetricColumn& metric) {
  const MetricHeading heading = metric_heading(metric);
  return {{"key", metric.key},       {"heading", metric.heading},      {"label", heading.label},
          {"unit", heading.unit},    {"whole", metric.whole},          {"effort", metric.effort},
          {"detail", metric.detail}, {"best_least", metric.best_least}};
}

Json system_json(const SystemDescription& system) {
  const JudgedKeys keys = judged_keys(system);
  const MetricHeading heading = metric_heading(judged_metric(system));
  Json json = {{"name", system.name},
               {"judged", keys.error},
               {"heading", judged_metric(system).heading},
               {"label", heading.label},
               {"unit", heading.unit},
               {"error", system.judged.error},
               {"margin", keys.margin},
               {"p95", keys.p95},
               {"worst", keys.worst},
               {"efforts", Json::array()},
               {"metrics", Json::array()},
               {"conditions", Json::array()},
               {"modes_key", system.modes_key},
               {"timing", {{"tick_s", system.timing.tick_s}, {"period_s", system.timing.period_s()}}}};
  for (const MetricColumn& effort : effort_metrics(system)) json["efforts"].push_back(metric_json(effort));
  for (const MetricColumn& metric : system.metrics) json["metrics"].push_back(metric_json(metric));
  for (const Signal& c : system.conditions)
    json["conditions"].push_back({{"key", c.key}, {"label", c.label}, {"unit", c.unit}});
  return json;
}

/// What a ranking is of: all runs of a table, or a group of it.
using Group = std::optional<std::uint32_t>;

Json solves_json(const SolveHistogram& solves) { return {{"first", solves.first}, {"counts", solves.counts}}; }

constexpr std::size_t most_points = 201;  // of a curve of the distribution: each half per cent

/// The same over single groups, so that all curves of a page stay below a megabyte; 0: none.
std::size_t points_of(std::size_t curves) {
  constexpr std::size_t all_points = 50'000, least = 21;
  const std::size_t points = std::min(most_points, all_points / std::max<std::size_t>(1, curves));
  return points < least ? 0 : points;
}

/// Sums and distribution of a variant, ranked or not.
void add_statistics(const RunTable& table, Group group, std::size_t points, const std::string& name, Json& json) {
  constexpr std::size_t few = 20;  // runs, below which a curve of their distribution says little
  const auto variant = static_cast<std::uint32_t>(std::ranges::find(table.variants(), name) - table.variants().begin());
  const SolveSums solves = table.solves(variant, group);
  json["solves"] = solves_json(solves.times);
  json["solves"]["late"] = solves.late;
  if (points == 0) return;
  const ErrorDistribution errors = table.distribution(variant, group, points);
  if (errors.ok >= few) json["distribution"] = {{"ok", errors.ok}, {"runs", errors.runs}, {"errors", errors.errors}};
}

Json ranked_json(const RankedVariant& v, const SystemDescription& system) {
  Json json = {
      {"variant", v.variant}, {"ranked", v.ranked}, {"runs", v.runs}, {"failed", v.failed}, {"unstable", v.unstable}};
  if (!v.ranked) return json;
  const JudgedKeys keys = judged_keys(system);
  json[keys.error] = v.error;
  json[keys.margin] = v.margin;
  json[keys.p95] = v.p95;
  json[keys.worst] = v.worst;
  const std::vector<MetricColumn> efforts = effort_metrics(system);
  for (std::size_t i = 0; i < efforts.size(); ++i) json[efforts[i].key] = v.efforts[i];
  json["solve_p50_us"] = v.solve_p50_us;
  json["solve_p99_us"] = v.solve_p99_us;
  return json;
}

Json ranking_json(const std::string& name, const RunTable& table, Group group, bool paired, Json scenarios) {
  const Ranking ranking = rank_variants(table, group);
  Json json = {{"name", name},
               {"scenarios", std::move(scenarios)},
               {"scenario_count", ranking.scenarios},
               {"common", ranking.common_scenarios},
               {"variants", Json::array()}};
  const std::size_t points = group ? points_of(table.variants().size() * table.groups().size()) : most_points;
  for (const RankedVariant& variant : ranking.variants) {
    json["variants"].push_back(ranked_json(variant, *ranking.system));
    add_statistics(table, group, points, variant.variant, json["variants"].back());
  }
  if (paired)
    if (std::optional<Against> found = against(table, ranking, "", group)) json["paired"] = std::move(found->json);
  return json;
}

/// Whether each ensemble is compared pair by pair too, so that all matrices of a page, with that over everything, which
/// PairedVariants::most_variants bounds, stay below a few megabytes.
bool pairs_fit(const RunTable& table) {
  constexpr std::size_t most_pairs = 10'000;  // a variant and its baseline
  std::size_t matrices = 1;
  for (std::uint32_t group = 0; group < table.groups().size(); ++group) matrices += table.is_ensemble(group);
  return matrices * table.variants().size() * table.variants().size() <= most_pairs;
}

/// Over everything, then over each ensemble and each single scenario, if there is more than one. `ended`: an interval
/// that is looked at while runs come in is none at 95 %, so before that nothing is compared in pairs.
Json rankings_json(const RunTable& table, const std::vector<StoredRun>& listed, bool ended) {
  Json all = Json::array();
  std::map<std::string, Json> by_group;
  std::string last;
  for (const StoredRun& run : listed) {
    const std::string& name = run.record.scenario;
    if (name == std::exchange(last, name)) continue;
    all.push_back(name);
    by_group.try_emplace(ensemble_name(name), Json::array()).first->second.push_back(name);
  }
  Json list = Json::array({ranking_json("all scenarios", table, {}, ended, std::move(all))});
  const bool paired = ended && pairs_fit(table);
  if (table.groups().size() > 1)
    for (std::uint32_t group = 0; group < table.groups().size(); ++group) {
      const std::string& name = table.groups()[group];
      const auto scenarios = by_group.try_emplace(name, Json::array()).first;
      list.push_back(ranking_json(name, table, group, paired && table.is_ensemble(group), scenarios->second));
    }
  return list;
}

Json counts_json(const RunTable& table) {
  const RunTable::Counts counts = table.counts();
  return {{"runs", table.size()}, {"ok", counts.ok}, {"unstable", counts.unstable}, {"failed", counts.failed}};
}

/// What is published for the runs of a campaign, one look-up for all seeds.
class Published {
 public:
  explicit Published(const Results& results) : results_(results) {}
  const Json& of(const RunRecord& record) {
    const auto [at, fresh] = known_.try_emplace({record.variant, record.scenario});
    if (!fresh) return at->second;
    const VariantConfig* variant = results_.variant(record.variant);
    const std::optional<ScenarioConfig> scenario = results_.scenario(record.scenario);
    if (variant && scenario) at->second = simulation_of(*scenario).published(*variant, *scenario);
    return at->second;
  }

 private:
  const Results& results_;
  std::map<std::pair<std::string, std::string>, Json> known_;
};

Json variants_json(const std::vector<VariantConfig>& variants, const SystemDescription& system) {
  Json list = Json::array();
  for (const VariantConfig& v : variants)
    list.push_back({{"name", v.name},
                    {"summary", v.summary},
                    {"solver", v.solver},
                    {system.modes_key, v.modes},
                    {"estimator", v.estimator}});
  return list;
}

}  // namespace

Json report_json(const Results& results, const std::map<std::string, std::string>& curves, bool live) {
  const BuildInfo build = build_info();
  const std::shared_ptr<const RunTable> table = results.table();
  const SystemDescription& system = results.campaign.system->description();
  Json json = {{"format", 1},
               {"campaign", results.manifest.value("campaign", "")},
               {"status", results.manifest.value("status", "")},
               {"generator", "solenoid " + build.version},
               {"folder_name", std::filesystem::path(results.folder).lexically_normal().filename().string()},
               {"deadline_us", 1e6 * period_of(results.campaign)},
               {"live", live},
               {"manifest", results.manifest},
               {"resolved_toml", results.campaign.resolved_toml},
               {"system", system_json(system)},
               {"variants", variants_json(results.campaign.variants, system)},
               {"counts", counts_json(*table)},
               {"sample", results.sampled()},
               {"rankings", rankings_json(*table, results.runs, results.manifest.value("status", "") != "running")},
               {"runs", Json::array()},
               {"left_out", Json::array()}};
  for (const LeftOut& out : results.left_out)
    json["left_out"].push_back({{"id", out.id}, {"reason", out.reason}, {"in_part", out.in_part}});
  Published published(results);
  for (const StoredRun& run : results.runs) {
    const auto found = curves.find(run.id);
    Json entry = {{"id", run.id}, {"trace", found == curves.end() ? "none" : found->second}};
    entry.update(to_json(run.record));
    if (!run.solves.counts.empty()) entry["solves"] = solves_json(run.solves);
    if (const Json& figures = published.of(run.record); figures.is_object()) entry.update(figures);
    json["runs"].push_back(std::move(entry));
  }
  return json;
}

}  // namespace solenoid
