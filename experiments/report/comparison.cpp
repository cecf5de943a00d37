#include "experiments/report/comparison.hpp"

#include "core/config/reader.hpp"
#include "experiments/plugin/python_rows.hpp"
#include "experiments/report/against.hpp"
#include "experiments/report/headings.hpp"
#include "experiments/report/ranking.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

using Column = Table::Column;

/// Marks the least of a column as the best, if there are several.
void mark_least(Table& table, std::size_t column) {
  Table::Cell* best = nullptr;
  std::size_t count = 0;
  for (Table::Row& row : table.rows) {
    if (row[column].value.is_null()) continue;
    if (!best || row[column].value.get<double>() < best->value.get<double>()) best = &row[column];
    ++count;
  }
  for (Table::Row& row : table.rows) row[column].marked = count > 1 && row[column].value == best->value;
}

constexpr std::size_t many = 20;  // scenarios from which on percentiles and intervals say something

/// "worst mm": of the judged metric, in its unit.
std::string judged_heading_of(const std::string& what, const SystemDescription& system) {
  const std::string unit = metric_heading(judged_metric(system)).unit;
  return unit.empty() ? what : what + " " + unit;
}

Table summary(const Ranking& ranking) {
  const SystemDescription& system = *ranking.system;
  const std::vector<MetricColumn> efforts = effort_metrics(system);
  const bool spread = ranking.common_scenarios >= many;
  const auto only_then = [&](const std::string& heading) { return spread ? heading : ""; };
  Table table{.columns = {Column("", "rank"), Column("", "variant", "<"), Column("", judged_metric(system).heading),
                          Column("", only_then("+- %")), Column("", only_then(judged_heading_of("95 %", system))),
                          Column("", judged_heading_of("worst", system))}};
  std::vector<std::size_t> marked = {2, 4, 5};
  for (const MetricColumn& effort : efforts) {
    if (effort.best_least) marked.push_back(table.columns.size());
    table.columns.push_back(Column("", effort.heading));
  }
  for (const char* heading : {"solve p50 us", "p99 us"}) {
    marked.push_back(table.columns.size());
    table.columns.push_back(Column("", heading));
  }
  table.columns.push_back(Column("", "failed"));
  for (const RankedVariant& v : ranking.variants) {
    const auto number = [&](double value) { return v.ranked ? Json(value) : Json(); };
    Table::Row row = {v.ranked ? Json(table.rows.size() + 1) : Json(),
                      v.variant,
                      number(v.error),
                      number(100 * (v.margin - 1)),
                      number(v.p95),
                      number(v.worst)};
    for (std::size_t i = 0; i < efforts.size(); ++i) row.push_back(v.ranked ? Json(v.efforts[i]) : Json());
    const bool solved = v.solve_p99_us > 0;  // a law solves nothing
    row.push_back(solved ? number(v.solve_p50_us) : Json());
    row.push_back(solved ? number(v.solve_p99_us) : Json());
    std::string troubles = fmt::format("{} of {}", v.failed, v.runs);
    if (v.unstable > 0) troubles += fmt::format(", {} unstable", v.unstable);
    row.push_back(troubles);
    table.add(std::move(row));
  }
  for (const std::size_t column : marked) mark_least(table, column);
  return table;
}

/// "sine: sine, mass factor 1.05": a scenario, its motion and its conditions.
std::string scenario_title(const RunRecord& run, const SystemDescription& system) {
  std::string title = fmt::format("{}: {}", run.scenario, run.trajectory);
  for (std::size_t i = 0; i < std::min(run.conditions.size(), system.conditions.size()); ++i)
    title +=
        fmt::format(", {} {}", system.conditions[i].label, value_text(run.conditions[i], system.conditions[i].unit));
  return title;
}

Table scenario_table(const std::vector<const RunRecord*>& runs) {
  const SystemDescription& system = description_of(*runs.front());
  Table table{.title = scenario_title(*runs.front(), system),
              .columns = {Column("", "  variant", "<"), Column("", "seed")}};
  std::vector<std::string> keys;
  std::vector<std::size_t> marked;
  for (const MetricColumn& metric : system.metrics) {
    if (!metric.detail || metric.heading.empty()) continue;
    if (metric.best_least) marked.push_back(table.columns.size());
    table.columns.push_back(Column("", metric.heading));
    keys.push_back(metric.key);
  }
  marked.push_back(table.columns.size());
  table.columns.push_back(Column("", "p99 us"));
  table.columns.push_back(Column("", "status", "<"));
  for (const RunRecord* r : runs) {
    Table::Row row = {"  " + r->variant, r->seed};
    for (const std::string& key : keys)
      row.push_back(r->metrics && r->metrics->has(key) ? Json(r->metrics->number(key)) : Json());
    row.push_back(r->metrics && r->metrics->solve_us.p99 > 0 ? Json(r->metrics->solve_us.p99) : Json());
    row.push_back(first_line(r->status));
    table.add(std::move(row));
  }
  for (const std::size_t column : marked) mark_least(table, column);
  return table;
}

/// What the ranking's columns are.
std::string ranking_note(const Ranking& ranking) {
  std::string note =
      fmt::format("* best. {}: geometric mean of the {} over {} of {} scenarios (those all ranked variants finished); ",
                  metric_heading(judged_metric(*ranking.system)).label, ranking.system->judged.error,
                  ranking.common_scenarios, ranking.scenarios);
  std::vector<std::string> efforts;
  for (const MetricColumn& effort : effort_metrics(*ranking.system)) efforts.push_back(metric_heading(effort).label);
  if (!efforts.empty()) note += enumeration(efforts) + (efforts.size() > 1 ? ": means; " : ": mean; ");
  note += "p50: median, p99: worst run.";
  return ranking.common_scenarios < many ? note : note + " +-: 95 % confidence interval of the mean.";
}

/// The ranking over each ensemble of scenarios by itself.
std::vector<Table> ensembles(const RunTable& runs) {
  std::vector<Table> tables;
  for (std::uint32_t group = 0; group < runs.groups().size(); ++group) {
    if (!runs.is_ensemble(group)) continue;
    const Ranking ranking = rank_variants(runs, group);
    tables.push_back(summary(ranking));
    tables.back().title = fmt::format("{}, {} plants", runs.groups()[group], ranking.scenarios);
  }
  return tables;
}

/// How variants compare with the baseline, task by task.
void add_paired(const RunTable& runs, const Ranking& ranking, const std::string& baseline, Result& result) {
  std::optional<Against> found = against(runs, ranking, baseline);
  if (!found) return;
  Json json = {{"system", runs.system().name}};
  json.update(found->json);
  result.facts["paired"].push_back(std::move(json));
  if (!baseline.empty()) result.flat = found->table;
  if (found->several_tasks || !baseline.empty()) result.tables.push_back(std::move(found->table));
}

/// Rankings, comparisons and their note; `heading`: of the first table.
void add_rankings(const RunTable& runs, const std::string& heading, const std::string& baseline, Result& result) {
  const Ranking ranking = rank_variants(runs);
  result.tables.push_back(summary(ranking));
  result.tables.back().title = heading;
  add_paired(runs, ranking, baseline, result);
  for (Table& table : ensembles(runs)) result.tables.push_back(std::move(table));
  result.notes.push_back(heading.empty() ? ranking_note(ranking) : heading + ": " + ranking_note(ranking));
}

void add_details(std::span<const RunRecord> records, const SystemDescription& system, Result& result) {
  std::vector<const RunRecord*> runs;
  const auto end_scenario = [&] {
    if (!runs.empty()) result.tables.push_back(scenario_table(runs));
    runs.clear();
  };
  for (const RunRecord& r : records) {
    if (&description_of(r) != &system) continue;
    if (!runs.empty() && runs.back()->scenario != r.scenario) end_scenario();
    runs.push_back(&r);
  }
  end_scenario();
}

Json facts_of(std::span<const RunRecord> records) {
  Json runs = Json::array();
  for (const RunRecord& record : records) runs.push_back(to_json(record));
  return {{"runs", std::move(runs)}};
}

}  // namespace

std::string real_time_note(std::span<const VariantConfig> variants) {
  std::vector<std::string> names;
  for (const VariantConfig& variant : variants)
    if (!is_real_time(variant)) names.push_back(variant.name);
  return names.empty() ? "" : fmt::format("Not real time, in simulation only: {}.", enumeration(names));
}

Result result_of(std::span<const RunRecord> records, bool details, const std::string& baseline) {
  Result result{.facts = facts_of(records)};
  const std::vector<RunTable> systems = tables_of(records);
  for (const RunTable& own : systems) {
    add_rankings(own, systems.size() > 1 ? own.system().name : "", baseline, result);
    if (details) add_details(records, own.system(), result);
  }
  return result;
}

Result result_of(const RunTable& runs, const std::string& baseline) {
  Result result;
  add_rankings(runs, "", baseline, result);
  return result;
}

void require_baseline(std::span<const std::string> variants, const std::string& baseline, const std::string& option) {
  if (baseline.empty()) return;
  if (variants.size() < 2) throw ConfigError(fmt::format("{}: one variant alone (allowed: with two or more)", option));
  if (std::ranges::count(variants, baseline) == 0)
    throw ConfigError(
        fmt::format("{}: '{}' is not compared (allowed: {})", option, baseline, fmt::join(variants, ", ")));
}

std::string runs_json(std::span<const RunRecord> records) { return Result{.facts = facts_of(records)}.json(); }

}  // namespace solenoid
