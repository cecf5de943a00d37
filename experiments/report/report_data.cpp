#include "experiments/report/report_data.hpp"

#include "controllers/systems.hpp"
#include "experiments/base/build_info.hpp"
#include "experiments/campaign/ensemble.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/report/headings.hpp"
#include "experiments/report/ranking.hpp"

#include <algorithm>
#include <filesystem>

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

Json ranking_json(const std::string& name, const std::vector<RunRecord>& records) {
  const Ranking ranking = rank_variants(records);
  Json json = {
      {"name", name}, {"scenarios", Json::array()}, {"common", ranking.common_scenarios}, {"variants", Json::array()}};
  for (const RunRecord& record : records)
    if (std::ranges::find(json["scenarios"], Json(record.scenario)) == json["scenarios"].end())
      json["scenarios"].push_back(record.scenario);
  for (const RankedVariant& variant : ranking.variants)
    json["variants"].push_back(ranked_json(variant, *ranking.system));
  return json;
}

/// Over everything, then over each ensemble and each single scenario, if there is more than one.
Json rankings_json(const std::vector<StoredRun>& runs) {
  std::vector<RunRecord> all;
  std::vector<std::pair<std::string, std::vector<RunRecord>>> groups;
  for (const StoredRun& run : runs) {
    all.push_back(run.record);
    const std::string name = ensemble_name(run.record.scenario);
    if (groups.empty() || groups.back().first != name) groups.push_back({name, {}});
    groups.back().second.push_back(run.record);
  }
  Json list = Json::array({ranking_json("all scenarios", all)});
  if (groups.size() > 1)
    for (const auto& [name, records] : groups) list.push_back(ranking_json(name, records));
  return list;
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

Json report_json(const Results& results, const std::map<std::string, RunCurves>& curves, bool live) {
  const BuildInfo build = build_info();
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
               {"rankings", rankings_json(results.runs)},
               {"runs", Json::array()},
               {"left_out", Json::array()}};
  for (const LeftOut& out : results.left_out)
    json["left_out"].push_back({{"id", out.id}, {"reason", out.reason}, {"in_part", out.in_part}});
  Published published(results);
  for (const StoredRun& run : results.runs) {
    const auto found = curves.find(run.id);
    Json entry = {{"id", run.id}, {"trace", found == curves.end() ? "none" : found->second.kind}};
    entry.update(to_json(run.record));
    if (found != curves.end())
      entry["solves"] = {{"first", found->second.solves.first}, {"counts", found->second.solves.counts}};
    if (const Json& figures = published.of(run.record); figures.is_object()) entry.update(figures);
    json["runs"].push_back(std::move(entry));
  }
  return json;
}

}  // namespace solenoid
