#include "experiments/base/result.hpp"
#include "experiments/systems/actuator/thesis/reproduce.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Column = Table::Column;

const std::string& title_of(const std::string& table) {
  static const std::string none;
  const auto& all = reproducible_tables();
  const auto known = std::ranges::find(all, table, &ReproducibleTable::name);
  return known == all.end() ? none : known->title;
}

/// Hundredths, as the thesis prints.
std::string printed(const Cell& cell) {
  if (!cell.thesis) return "-";
  return fmt::format("{}{:.2f}", cell.thesis->upper_bound ? "<" : "", cell.thesis->value);
}

std::string ours(const Cell& cell) {
  return cell.runs > 1 ? fmt::format("{:.2f} +-{:.2f}", cell.ours, cell.ours_spread) : fmt::format("{:.2f}", cell.ours);
}

/// The cells of one table and parameter set: a row a case, two columns a metric.
Table block(std::span<const Cell> cells) {
  Table table{.title = fmt::format("parameters {}: {}", cells.front().parameters,
                                   parameters_in_words(cells.front().parameters)),
              .columns = {{"", "case", "<"}}};
  const std::string& first_case = cells.front().case_name;
  for (const Cell& cell : cells) {
    if (cell.case_name == first_case) {
      table.columns.push_back({"", cell.metric + ": thesis"});
      table.columns.push_back({"", "ours"});
    }
    if (table.rows.empty() || table.rows.back().front().value != cell.case_name) table.add({cell.case_name});
    table.rows.back().insert(table.rows.back().end(), {printed(cell), ours(cell)});
  }
  return table;
}

/// Every cell, for data alone. JSON has spread and runs of several seeds only.
Table all_cells(std::span<const Cell> cells) {
  using Data = Table::Data;
  Table table{.name = "cells",
              .columns = {Column("table"), Column("parameters"), Column("case"), Column("metric"),
                          Column("thesis_bound?"), Column("thesis"), Column("ours"),
                          Column("ours_spread", "", "", Data::csv), Column("runs", "", "", Data::csv),
                          Column("ours_spread?", "", "", Data::json), Column("runs?", "", "", Data::json)}};
  for (const Cell& c : cells) {
    const bool several = c.runs > 1;
    table.add({c.table, c.parameters, c.case_name, c.metric, c.thesis && c.thesis->upper_bound ? Json("<") : Json(),
               c.thesis ? Json(c.thesis->value) : Json(), c.ours, c.ours_spread, c.runs,
               several ? Json(c.ours_spread) : Json(), several ? Json(c.runs) : Json()});
  }
  return table;
}

}  // namespace

std::string parameters_in_words(const std::string& name) {
  if (const auto plus = name.find("+integral_per_period"); plus != std::string::npos)
    return parameters_in_words(name.substr(0, plus)) + "; the integral summed once a period of 5 ms";
  if (name == "twin") return "the nominal truth plant (docs/reference/twin.md) behind the whole sensing chain";
  const bool printed = name.starts_with("printed"), inferred = name.find("inferred") != std::string::npos;
  const bool rod = name.find("no_rod_atmosphere") == std::string::npos;
  return fmt::format("choked flow {} (E2), {} (E8), {} atmosphere on the rod's area (E9)",
                     printed ? "0.0061 kg/s as printed" : "0.00061 kg/s, continuous with the rest of the flow law",
                     inferred ? "inertia and gravity inferred from the thesis's percentages" : "inertia as printed",
                     rod ? "with" : "without");
}

Result result_of(std::span<const Cell> cells) {
  Result result{.tables = {all_cells(cells)}};
  std::string table;
  for (auto from = cells.begin(); from != cells.end();) {
    const auto to = std::find_if(
        from, cells.end(), [&](const Cell& c) { return c.table != from->table || c.parameters != from->parameters; });
    Table next = block({from, to});
    if (from->table != table) next.title = fmt::format("{}: {}\n\n{}", from->table, title_of(from->table), next.title);
    table = from->table;
    result.tables.push_back(std::move(next));
    from = to;
  }
  Table near{.name = "agreement",
             .title = "mean |ln(ours/thesis)| over the tables above",
             .columns = {Column("tables", "tables", "<"), Column("parameters", "parameters", "<"),
                         Column("metric", "metric", "<"), Column("mean_abs_ln", "mean |ln|", ".2f"),
                         Column("cells", "cells")}};
  for (const Agreement& a : agreements(cells)) near.add({a.tables, a.parameters, a.metric, a.mean_abs_ln, a.cells});
  result.tables.push_back(std::move(near));
  return result;
}

}  // namespace solenoid
