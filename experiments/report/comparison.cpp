#include "experiments/report/comparison.hpp"

#include "experiments/campaign/ensemble.hpp"
#include "experiments/report/ranking.hpp"

#include <algorithm>

#include <fmt/format.h>

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

Table summary(const Ranking& ranking) {
  const bool spread = ranking.common_scenarios >= many;
  const auto only_then = [&](const char* heading) { return spread ? heading : ""; };
  Table table{.columns = {Column("", "rank"), Column("", "variant", "<"), Column("", "RMSE mm"),
                          Column("", only_then("+- %")), Column("", only_then("95 % mm")), Column("", "worst mm"),
                          Column("", "switches/s"), Column("", "air g"), Column("", "solve p50 us"),
                          Column("", "p99 us"), Column("", "failed")}};
  for (const RankedVariant& v : ranking.variants) {
    const auto number = [&](double value) { return v.ranked ? Json(value) : Json(); };
    std::string troubles = fmt::format("{} of {}", v.failed, v.runs);
    if (v.unstable > 0) troubles += fmt::format(", {} unstable", v.unstable);
    table.add({v.ranked ? Json(table.rows.size() + 1) : Json(), v.variant, number(v.rmse_mm),
               number(100 * (v.rmse_margin - 1)), number(v.p95_rmse_mm), number(v.worst_rmse_mm),
               number(v.switches_per_s), number(v.air_g), number(v.solve_p50_us), number(v.solve_p99_us), troubles});
  }
  for (const std::size_t column : {2, 4, 5, 6, 7, 8, 9}) mark_least(table, column);
  return table;
}

Table scenario_table(const std::vector<const RunRecord*>& runs) {
  const RunRecord& first = *runs.front();
  Table table{.title = fmt::format("{}: {}, payload {} kg", first.scenario, first.trajectory, first.payload_kg),
              .columns = {Column("", "  variant", "<"), Column("", "seed"), Column("", "RMSE mm"), Column("", "MAE mm"),
                          Column("", "measured RMSE"), Column("", "switches"), Column("", "air g"),
                          Column("", "motor N"), Column("", "p99 us"), Column("", "status", "<")}};
  for (const RunRecord* r : runs) {
    const auto number = [&](const char* metric) { return r->metrics ? Json(r->metrics->number(metric)) : Json(); };
    table.add({"  " + r->variant, r->seed, number("rmse_mm"), number("mae_mm"), number("rmse_measured_mm"),
               number("coil_switches"), number("air_g"), number("motor_rms_n"),
               r->metrics ? Json(r->metrics->solve_us.p99) : Json(), r->status});
  }
  for (const std::size_t column : {2, 3, 4, 5, 6, 8}) mark_least(table, column);
  return table;
}

/// The ranking over each ensemble of scenarios by itself.
std::vector<Table> ensembles(std::span<const RunRecord> records) {
  std::vector<std::pair<std::string, std::vector<RunRecord>>> groups;
  for (const RunRecord& r : records) {
    const std::string name = ensemble_name(r.scenario);
    if (name == r.scenario) continue;
    auto at = std::ranges::find(groups, name, &std::pair<std::string, std::vector<RunRecord>>::first);
    if (at == groups.end()) at = groups.insert(at, {name, {}});
    at->second.push_back(r);
  }
  std::vector<Table> tables;
  for (const auto& [name, runs] : groups) {
    const Ranking ranking = rank_variants(runs);
    tables.push_back(summary(ranking));
    tables.back().title = fmt::format("{}, {} plants", name, ranking.scenarios);
  }
  return tables;
}

}  // namespace

Result result_of(std::span<const RunRecord> records, bool details) {
  const Ranking ranking = rank_variants(records);
  Result result{.facts = {{"runs", Json::array()}}, .tables = {summary(ranking)}};
  for (const RunRecord& record : records) result.facts["runs"].push_back(to_json(record));
  for (Table& table : ensembles(records)) result.tables.push_back(std::move(table));
  for (std::size_t i = 0; details && i < records.size();) {
    std::vector<const RunRecord*> runs;
    for (const std::string& scenario = records[i].scenario; i < records.size() && records[i].scenario == scenario; ++i)
      runs.push_back(&records[i]);
    result.tables.push_back(scenario_table(runs));
  }
  result.notes = {fmt::format(
      "* best. RMSE: geometric mean of the true position error over {} of {} scenarios (those all ranked variants "
      "finished); switches/s and air: means; p50: median, p99: worst run.{}",
      ranking.common_scenarios, ranking.scenarios,
      ranking.common_scenarios < many ? "" : " +-: 95 % confidence interval of the mean.")};
  return result;
}

}  // namespace solenoid
