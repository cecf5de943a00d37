#include "experiments/campaign/run_record.hpp"

#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/campaign/simulated_system.hpp"

#include <cmath>
#include <cstdint>
#include <iterator>
#include <type_traits>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

constexpr SolverColumn columns[] = {
    {"solve_us_p50", &Percentiles::p50, "p50"},
    {"solve_us_p90", &Percentiles::p90, "p90"},
    {"solve_us_p99", &Percentiles::p99, "p99"},
    {"solve_us_p999", &Percentiles::p999, "p999"},
    {"solve_us_max", &Percentiles::max, "max"},
    {"deadline_misses", nullptr, nullptr, &Metrics::deadline_misses},
    {"proven_optimal_fraction", nullptr, nullptr, nullptr, &Metrics::proven_optimal_fraction},
};

Json number_json(double value, bool whole) { return whole ? Json(static_cast<std::int64_t>(value)) : Json(value); }

RunRecord described(const Campaign& campaign, const CampaignRun& run) {
  const ScenarioConfig& scenario = campaign.scenarios[run.scenario];
  const std::vector<double> conditions = simulation_of(scenario).conditions(scenario);
  if (conditions.size() != campaign.system->description().conditions.size())
    throw std::logic_error(fmt::format("{}: conditions() of another number than described", campaign.system->name()));
  return {campaign.variants[run.variant].name,
          scenario.name,
          scenario.trajectory_kind,
          conditions,
          run.seed,
          "",
          {},
          campaign.system->name()};
}

/// Reads values by their keys; every refusal names file and key.
class RecordReader {
 public:
  RecordReader(const Json& object, std::string name, std::string path = "run")
      : object_(object), name_(std::move(name)), path_(std::move(path)) {}

  template <class T>
  T value(const std::string& key) const {
    const Json& found = at(key);
    if constexpr (std::is_same_v<T, std::string>) {
      if (!found.is_string()) refuse(key, "wrong type (allowed: a text)");
    } else {
      constexpr double low = std::is_floating_point_v<T> ? -1e300 : 0.0;  // no whole number of a record is below 0
      constexpr double high = std::is_same_v<T, int> ? 2147483647.0 : std::is_floating_point_v<T> ? 1e300 : 18e18;
      const double number = found.is_number() ? found.template get<double>() : -1e301;
      if (number < low || number > high) refuse(key, fmt::format("refused (allowed: {:g} to {:g})", low, high));
    }
    return found.template get<T>();
  }
  RecordReader inside(const std::string& key) const { return {at(key), name_, path_ + "." + key}; }

 private:
  const Json& at(const std::string& key) const {
    if (!object_.is_object() || !object_.contains(key)) refuse(key, "missing (allowed: what `compare` wrote)");
    return object_.at(key);
  }
  [[noreturn]] void refuse(const std::string& key, const std::string& problem) const {
    throw ConfigError(fmt::format("{}: key '{}.{}': {}", name_, path_, key, problem));
  }

  const Json& object_;
  std::string name_, path_;
};

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

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

const SystemDescription& description_of(const RunRecord& record) {
  const System* system = find_system(record.system);
  return (system ? system : systems().front())->description();
}

RunRecord record_of(const Campaign& campaign, const CampaignRun& run, const Metrics& metrics) {
  RunRecord record = described(campaign, run);
  bool finite = metrics.finite;
  for (const Metrics::Number& number : metrics.numbers()) finite = finite && std::isfinite(number.value);
  for (const SolverColumn& column : columns) finite = finite && std::isfinite(column.value(metrics));
  record.status = finite ? "ok" : "unstable";
  if (finite) record.metrics = metrics;
  return record;
}

RunRecord failed_record(const Campaign& campaign, const CampaignRun& run, const std::string& reason) {
  RunRecord record{
      campaign.variants[run.variant].name, campaign.scenarios.name(run.scenario), "", {}, run.seed, "", {}};
  try {
    record = described(campaign, run);
  } catch (const ConfigError&) {  // a member of an ensemble that cannot be read: that is the reason
    record.conditions.resize(campaign.system->description().conditions.size());
    record.system = campaign.system->name();
  }
  record.status = "failed: " + reason;
  return record;
}

Json to_json(const RunRecord& record) {
  const SystemDescription& system = description_of(record);
  Json json = {{"system", system.name},
               {"variant", record.variant},
               {"scenario", record.scenario},
               {"trajectory", record.trajectory}};
  for (std::size_t i = 0; i < system.conditions.size(); ++i)
    json[system.conditions[i].key] = i < record.conditions.size() ? record.conditions[i] : 0.0;
  json["seed"] = record.seed;
  if (record.metrics) {
    const Metrics& m = *record.metrics;
    for (const MetricColumn& metric : system.metrics)
      if (m.has(metric.key)) json[metric.key] = number_json(m.number(metric.key), metric.whole);
    for (const SolverColumn& column : columns) {
      if (column.number) json[column.name] = m.*column.number;
      if (column.count) json[column.name] = m.*column.count;
      if (column.solve_us) json["solve_us"][column.inner] = m.solve_us.*column.solve_us;
    }
  }
  json["status"] = record.status;
  return json;
}

RunRecord record_from_json(const Json& json, const std::string& name) {
  const RecordReader run(json, name);
  RunRecord record;
  record.system = json.is_object() && json.contains("system") ? run.value<std::string>("system") : "";
  record.variant = run.value<std::string>("variant");
  record.scenario = run.value<std::string>("scenario");
  record.trajectory = run.value<std::string>("trajectory");
  for (const Signal& condition : description_of(record).conditions)
    record.conditions.push_back(run.value<double>(condition.key));
  record.seed = run.value<std::uint64_t>("seed");
  record.status = run.value<std::string>("status");
  if (!record.ok()) return record;
  Metrics m;
  for (const MetricColumn& metric : description_of(record).metrics)
    if (json.contains(metric.key)) m.set(metric.key, run.value<double>(metric.key));
  for (const SolverColumn& column : columns) {
    if (column.number) m.*column.number = run.value<double>(column.name);
    if (column.count) m.*column.count = run.value<int>(column.name);
    if (column.solve_us) m.solve_us.*column.solve_us = run.inside("solve_us").value<double>(column.inner);
  }
  record.metrics = m;
  return record;
}

std::string to_csv(std::span<const RunRecord> records) {
  const SystemDescription& system =
      records.empty() ? systems().front()->description() : description_of(records.front());
  std::string text = csv_heading(system);
  for (const RunRecord& r : records) append_csv_line(r, system, text);
  return text;
}

std::string csv_heading(const SystemDescription& system) {
  std::string text = "variant,scenario,trajectory";
  for (const Signal& condition : system.conditions) text += "," + condition.key;
  text += ",seed";
  for (const MetricColumn& metric : system.metrics) text += "," + metric.key;
  for (const SolverColumn& column : columns) text += fmt::format(",{}", column.name);
  return text + ",status\n";
}

void append_csv_line(const RunRecord& r, const SystemDescription& system, std::string& text) {
  const auto append = [&](const auto& value) { fmt::format_to(std::back_inserter(text), ",{}", value); };
  text += csv_text(r.variant);
  append(csv_text(r.scenario));
  append(r.trajectory);
  for (const double condition : r.conditions) append(condition);
  append(r.seed);
  for (const MetricColumn& metric : system.metrics) {
    if (r.metrics && r.metrics->has(metric.key))
      append(r.metrics->number(metric.key));
    else
      text += ',';
  }
  for (const SolverColumn& column : columns) {
    if (r.metrics)
      append(column.value(*r.metrics));
    else
      text += ',';
  }
  append(csv_text(r.status));
  text += '\n';
}

double SolverColumn::value(const Metrics& m) const {
  if (number) return m.*number;
  if (count) return m.*count;
  return m.solve_us.*solve_us;
}

void SolverColumn::set(Metrics& m, double value) const {
  if (number) m.*number = value;
  if (count) m.*count = static_cast<int>(value);
  if (solve_us) m.solve_us.*solve_us = value;
}

std::span<const SolverColumn> solver_columns() { return columns; }

}  // namespace solenoid
