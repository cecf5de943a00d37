#include "experiments/report/comparison.hpp"

#include "experiments/base/text_table.hpp"
#include "experiments/campaign/ensemble.hpp"
#include "experiments/report/ranking.hpp"

#include <algorithm>
#include <functional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Align = TextTable::Align;

/// The cells of one number over rows, the least marked as the best; rows without it read "-".
template <class Row, class Value>
std::vector<TextTable::Cell> column(const std::vector<Row>& rows, const std::function<bool(const Row&)>& has,
                                    Value value) {
  std::vector<TextTable::Cell> cells;
  double best = std::numeric_limits<double>::infinity();
  std::size_t count = 0;
  for (const Row& row : rows)
    if (has(row)) best = std::min(best, static_cast<double>(value(row))), ++count;
  for (const Row& row : rows) {
    if (!has(row))
      cells.push_back({"-"});
    else
      cells.push_back({short_number(value(row)), count > 1 && static_cast<double>(value(row)) == best});
  }
  return cells;
}

/// For a number of which less is not better.
std::vector<TextTable::Cell> unmarked(std::vector<TextTable::Cell> cells) {
  for (TextTable::Cell& cell : cells) cell.marked = false;
  return cells;
}

std::string troubles(const RankedVariant& v) {
  std::string text = fmt::format("{} of {}", v.failed, v.runs);
  if (v.unstable > 0) text += fmt::format(", {} unstable", v.unstable);
  return text;
}

constexpr std::size_t many = 20;  // scenarios from which on percentiles and intervals say something

std::string summary_text(const Ranking& ranking, bool colour) {
  using V = RankedVariant;
  const std::vector<V>& rows = ranking.variants;
  const std::function<bool(const V&)> ranked = [](const V& v) { return v.ranked; };
  const bool spread = ranking.common_scenarios >= many;
  std::vector<std::vector<TextTable::Cell>> numbers = {
      column(rows, ranked, [](const V& v) { return v.rmse_mm; }),
      column(rows, ranked, [](const V& v) { return v.worst_rmse_mm; }),
      column(rows, ranked, [](const V& v) { return v.switches_per_s; }),
      column(rows, ranked, [](const V& v) { return v.air_g; }),
      column(rows, ranked, [](const V& v) { return v.solve_p50_us; }),
      column(rows, ranked, [](const V& v) { return v.solve_p99_us; })};
  std::vector<TextTable::Column> columns = {
      {"rank"},  {"variant", Align::left}, {"RMSE mm"}, {"worst mm"}, {"switches/s"},
      {"air g"}, {"solve p50 us"},         {"p99 us"},  {"failed"}};
  if (spread) {
    const auto after = [](auto& list, std::ptrdiff_t i) { return list.begin() + i; };
    numbers.insert(after(numbers, 1), column(rows, ranked, [](const V& v) { return v.p95_rmse_mm; }));
    numbers.insert(after(numbers, 1),
                   unmarked(column(rows, ranked, [](const V& v) { return 100 * (v.rmse_margin - 1); })));
    columns.insert(after(columns, 3), {{"+- %"}, {"95 % mm"}});
  }
  TextTable table(columns);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::vector<TextTable::Cell> cells = {{rows[i].ranked ? fmt::format("{}", i + 1) : "-"}, {rows[i].variant}};
    for (const auto& number : numbers) cells.push_back(number[i]);
    cells.push_back({troubles(rows[i])});
    table.add_row(std::move(cells));
  }
  return table.text(colour);
}

std::string scenario_text(const std::vector<const RunRecord*>& runs, bool colour) {
  using R = const RunRecord*;
  const std::function<bool(const R&)> ok = [](const R& r) { return r->metrics.has_value(); };
  const auto number = [&](auto member) { return column(runs, ok, [=](const R& r) { return (*r->metrics).*member; }); };
  const std::vector<std::vector<TextTable::Cell>> numbers = {
      number(&Metrics::rmse_mm),
      number(&Metrics::mae_mm),
      number(&Metrics::rmse_measured_mm),
      number(&Metrics::coil_switches),
      number(&Metrics::air_g),
      unmarked(number(&Metrics::motor_rms_n)),
      column(runs, ok, [](const R& r) { return r->metrics->solve_us.p99; })};
  TextTable table({{"  variant", Align::left},
                   {"seed"},
                   {"RMSE mm"},
                   {"MAE mm"},
                   {"measured RMSE"},
                   {"switches"},
                   {"air g"},
                   {"motor N"},
                   {"p99 us"},
                   {"status", Align::left}});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    std::vector<TextTable::Cell> cells = {{"  " + runs[i]->variant}, {fmt::format("{}", runs[i]->seed)}};
    for (const auto& cell : numbers) cells.push_back(cell[i]);
    cells.push_back({runs[i]->status});
    table.add_row(std::move(cells));
  }
  const RunRecord& first = *runs.front();
  return fmt::format("\n{}: {}, payload {} kg\n{}", first.scenario, first.trajectory, first.payload_kg,
                     table.text(colour));
}

/// The ranking over each ensemble of scenarios by itself.
std::string ensembles_text(std::span<const RunRecord> records, bool colour) {
  std::vector<std::pair<std::string, std::vector<RunRecord>>> ensembles;
  for (const RunRecord& r : records) {
    const std::string name = ensemble_name(r.scenario);
    if (name == r.scenario) continue;
    auto at = std::ranges::find(ensembles, name, &std::pair<std::string, std::vector<RunRecord>>::first);
    if (at == ensembles.end()) at = ensembles.insert(at, {name, {}});
    at->second.push_back(r);
  }
  std::string text;
  for (const auto& [name, runs] : ensembles) {
    const Ranking ranking = rank_variants(runs);
    text += fmt::format("\n{}, {} plants\n{}", name, ranking.scenarios, summary_text(ranking, colour));
  }
  return text;
}

}  // namespace

std::string comparison_text(std::span<const RunRecord> records, bool details, bool colour) {
  const Ranking ranking = rank_variants(records);
  std::string text = summary_text(ranking, colour) + ensembles_text(records, colour);
  for (std::size_t i = 0; details && i < records.size();) {
    std::vector<const RunRecord*> runs;
    for (const std::string& scenario = records[i].scenario; i < records.size() && records[i].scenario == scenario; ++i)
      runs.push_back(&records[i]);
    text += scenario_text(runs, colour);
  }
  return text + fmt::format(
                    "\n* best. RMSE: geometric mean of the true position error over {} of {} scenarios (those "
                    "all ranked variants finished); switches/s and air: means; p50: median, p99: worst run.{}\n",
                    ranking.common_scenarios, ranking.scenarios,
                    ranking.common_scenarios < many ? "" : " +-: 95 % confidence interval of the mean.");
}

std::string comparison_json(std::span<const RunRecord> records) {
  nlohmann::ordered_json runs = nlohmann::ordered_json::array();
  for (const RunRecord& record : records) runs.push_back(to_json(record));
  using Handler = nlohmann::ordered_json::error_handler_t;
  return nlohmann::ordered_json{{"runs", std::move(runs)}}.dump(1, ' ', false, Handler::replace) + "\n";
}

}  // namespace solenoid
