#include "experiments/report/report_data.hpp"

#include "experiments/base/build_info.hpp"
#include "experiments/campaign/ensemble.hpp"
#include "experiments/report/ranking.hpp"
#include "experiments/report/thesis_cell.hpp"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

Json ranked_json(const RankedVariant& v) {
  Json json = {
      {"variant", v.variant}, {"ranked", v.ranked}, {"runs", v.runs}, {"failed", v.failed}, {"unstable", v.unstable}};
  if (!v.ranked) return json;
  json.update({{"rmse_mm", v.rmse_mm},
               {"rmse_margin", v.rmse_margin},
               {"p95_rmse_mm", v.p95_rmse_mm},
               {"worst_rmse_mm", v.worst_rmse_mm},
               {"switches_per_s", v.switches_per_s},
               {"air_g", v.air_g},
               {"solve_p50_us", v.solve_p50_us},
               {"solve_p99_us", v.solve_p99_us}});
  return json;
}

Json ranking_json(const std::string& name, const std::vector<RunRecord>& records) {
  const Ranking ranking = rank_variants(records);
  Json json = {
      {"name", name}, {"scenarios", Json::array()}, {"common", ranking.common_scenarios}, {"variants", Json::array()}};
  for (const RunRecord& record : records)
    if (std::ranges::find(json["scenarios"], Json(record.scenario)) == json["scenarios"].end())
      json["scenarios"].push_back(record.scenario);
  for (const RankedVariant& variant : ranking.variants) json["variants"].push_back(ranked_json(variant));
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

std::string printed(const PrintedNumber& number) {
  return fmt::format("{}{}", number.upper_bound ? "<" : "", number.value);
}

Json thesis_json(const ThesisCell& cell) {
  Json json = {{"table", cell.table},
               {"measured", cell.measured},
               {"rmse_mm", printed(cell.rmse_mm)},
               {"mae_mm", printed(cell.mae_mm)}};
  if (cell.sse_mm) json["sse_mm"] = printed(*cell.sse_mm);
  if (cell.ssa_mm) json["ssa_mm"] = printed(*cell.ssa_mm);
  return json;
}

/// The thesis's cells of a campaign, one look-up for all seeds.
class ThesisCells {
 public:
  explicit ThesisCells(const Results& results) : results_(results) {}
  const std::optional<ThesisCell>& of(const RunRecord& record) {
    const auto [at, fresh] = cells_.try_emplace({record.variant, record.scenario});
    const VariantConfig* variant = results_.variant(record.variant);
    const ScenarioConfig* scenario = results_.scenario(record.scenario);
    if (fresh && variant && scenario) at->second = thesis_cell(*variant, *scenario);
    return at->second;
  }

 private:
  const Results& results_;
  std::map<std::pair<std::string, std::string>, std::optional<ThesisCell>> cells_;
};

Json variants_json(const std::vector<VariantConfig>& variants) {
  Json list = Json::array();
  for (const VariantConfig& v : variants)
    list.push_back(
        {{"name", v.name}, {"summary", v.summary}, {"solver", v.solver}, {"valves", v.valves}, {"motor", v.motor}});
  return list;
}

}  // namespace

Json report_json(const Results& results, const std::map<std::string, RunCurves>& curves, bool live) {
  const BuildInfo build = build_info();
  Json json = {{"format", 1},
               {"campaign", results.manifest.value("campaign", "")},
               {"status", results.manifest.value("status", "")},
               {"generator", "solenoid " + build.version},
               {"folder_name", std::filesystem::path(results.folder).lexically_normal().filename().string()},
               {"deadline_us", 1e6 * period_of(results.campaign)},
               {"live", live},
               {"manifest", results.manifest},
               {"resolved_toml", results.campaign.resolved_toml},
               {"variants", variants_json(results.campaign.variants)},
               {"rankings", rankings_json(results.runs)},
               {"runs", Json::array()}};
  ThesisCells thesis(results);
  for (const StoredRun& run : results.runs) {
    const auto found = curves.find(run.id);
    Json entry = {{"id", run.id}, {"trace", found == curves.end() ? "none" : found->second.kind}};
    entry.update(to_json(run.record));
    if (found != curves.end())
      entry["solves"] = {{"first", found->second.solves.first}, {"counts", found->second.solves.counts}};
    if (const auto& cell = thesis.of(run.record)) entry["thesis"] = thesis_json(*cell);
    json["runs"].push_back(std::move(entry));
  }
  return json;
}

}  // namespace solenoid
