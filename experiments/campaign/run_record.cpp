#include "experiments/campaign/run_record.hpp"

#include <cmath>
#include <functional>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

/// One reported number: the one list that JSON, CSV and reading back share.
struct RunColumn {
  const char* name;
  double Metrics::*number = nullptr;
  int Metrics::*count = nullptr;
  double Percentiles::*solve_us = nullptr;  ///< in JSON inside `solve_us`, by `inner`
  const char* inner = nullptr;
  bool later = false;  ///< results folders of earlier programs do not have it

  double value(const Metrics& m) const {
    if (number) return m.*number;
    if (count) return m.*count;
    return m.solve_us.*solve_us;
  }
};

const std::vector<RunColumn>& columns() {
  using M = Metrics;
  using P = Percentiles;
  static const std::vector<RunColumn> all = {
      {"rmse_mm", &M::rmse_mm},
      {"mae_mm", &M::mae_mm},
      {"rmse_measured_mm", &M::rmse_measured_mm},
      {"mae_measured_mm", &M::mae_measured_mm},
      {"sse_mean_abs_mm", &M::sse_mean_abs_mm},
      {"sse_abs_mean_mm", &M::sse_abs_mean_mm},
      {.name = "sse_max_abs_mm", .number = &M::sse_max_abs_mm, .later = true},
      {"ssa_mm", &M::ssa_mm},
      {"itae", &M::itae},
      {"overshoot_percent", &M::overshoot_percent},
      {"coil_switches", nullptr, &M::coil_switches},
      {"switches_per_s", &M::switches_per_s},
      {.name = "steady_switches_per_s", .number = &M::steady_switches_per_s, .later = true},
      {"air_g", &M::air_g},
      {"air_nl", &M::air_nl},
      {.name = "steady_air_g_per_s", .number = &M::steady_air_g_per_s, .later = true},
      {"motor_rms_n", &M::motor_rms_n},
      {"solve_us_p50", nullptr, nullptr, &P::p50, "p50"},
      {"solve_us_p90", nullptr, nullptr, &P::p90, "p90"},
      {"solve_us_p99", nullptr, nullptr, &P::p99, "p99"},
      {"solve_us_p999", nullptr, nullptr, &P::p999, "p999"},
      {"solve_us_max", nullptr, nullptr, &P::max, "max"},
      {"deadline_misses", nullptr, &M::deadline_misses},
      {"proven_optimal_fraction", &M::proven_optimal_fraction},
  };
  return all;
}

RunRecord described(const Campaign& campaign, const CampaignRun& run) {
  const ScenarioConfig& scenario = campaign.scenarios[run.scenario];
  return {campaign.variants[run.variant].name,
          scenario.name,
          scenario.trajectory_kind,
          scenario.payload_kg,
          run.seed,
          "",
          {}};
}

/// Quoted when a CSV reader would need it.
std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c == '\n' || c == '\r' ? ' ' : c;
  }
  return quoted + '"';
}

}  // namespace

RunRecord record_of(const Campaign& campaign, const CampaignRun& run, const Metrics& metrics) {
  RunRecord record = described(campaign, run);
  bool finite = metrics.finite;
  for (const RunColumn& column : columns()) finite = finite && std::isfinite(column.value(metrics));
  record.status = finite ? "ok" : "unstable";
  if (finite) record.metrics = metrics;
  return record;
}

RunRecord failed_record(const Campaign& campaign, const CampaignRun& run, const std::string& reason) {
  RunRecord record = described(campaign, run);
  record.status = "failed: " + reason;
  return record;
}

Json to_json(const RunRecord& record) {
  Json json = {{"variant", record.variant},
               {"scenario", record.scenario},
               {"trajectory", record.trajectory},
               {"payload_kg", record.payload_kg},
               {"seed", record.seed}};
  if (record.metrics) {
    const Metrics& m = *record.metrics;
    for (const RunColumn& column : columns()) {
      if (column.number) json[column.name] = m.*column.number;
      if (column.count) json[column.name] = m.*column.count;
      if (column.solve_us) json["solve_us"][column.inner] = m.solve_us.*column.solve_us;
    }
  }
  json["status"] = record.status;
  return json;
}

RunRecord record_from_json(const Json& json) {
  RunRecord record;
  json.at("variant").get_to(record.variant);
  json.at("scenario").get_to(record.scenario);
  json.at("trajectory").get_to(record.trajectory);
  json.at("payload_kg").get_to(record.payload_kg);
  json.at("seed").get_to(record.seed);
  json.at("status").get_to(record.status);
  if (!record.ok()) return record;
  Metrics m;
  for (const RunColumn& column : columns()) {
    if (column.later && !json.contains(column.name)) continue;
    if (column.number) json.at(column.name).get_to(m.*column.number);
    if (column.count) json.at(column.name).get_to(m.*column.count);
    if (column.solve_us) json.at("solve_us").at(column.inner).get_to(m.solve_us.*column.solve_us);
  }
  record.metrics = m;
  return record;
}

std::string to_csv(std::span<const RunRecord> records) {
  std::string text = "variant,scenario,trajectory,payload_kg,seed";
  for (const RunColumn& column : columns()) text += fmt::format(",{}", column.name);
  text += ",status\n";
  for (const RunRecord& r : records) {
    text +=
        fmt::format("{},{},{},{},{}", csv_text(r.variant), csv_text(r.scenario), r.trajectory, r.payload_kg, r.seed);
    for (const RunColumn& column : columns())
      text += r.metrics ? fmt::format(",{}", column.value(*r.metrics)) : std::string(",");
    text += fmt::format(",{}\n", csv_text(r.status));
  }
  return text;
}

}  // namespace solenoid
