#include "experiments/thesis/reproduce_output.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

nlohmann::ordered_json number_or_null(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

const std::string& title_of(const std::string& table) {
  static const std::string none;
  for (const ReproducibleTable& known : reproducible_tables())
    if (known.name == table) return known.title;
  return none;
}

/// Hundredths, as the thesis prints.
std::string printed(const Cell& cell) {
  if (!cell.thesis) return "-";
  return fmt::format("{}{:.2f}", cell.thesis->upper_bound ? "<" : "", cell.thesis->value);
}

std::string ours(const Cell& cell) {
  return cell.runs > 1 ? fmt::format("{:.2f} +-{:.2f}", cell.ours, cell.ours_spread) : fmt::format("{:.2f}", cell.ours);
}

/// A column: a heading line, a line "thesis | ours", then one pair a case.
struct Column {
  std::string heading;
  std::vector<std::string> thesis, ours;
};

std::size_t widest(const std::vector<std::string>& texts, std::size_t at_least) {
  for (const std::string& text : texts) at_least = std::max(at_least, text.size());
  return at_least;
}

std::string quoted(const std::string& text) {
  return text.find_first_of(",\"") == std::string::npos ? text : '"' + text + '"';
}

/// The cells of one table and parameter set.
std::string block_text(std::span<const Cell> cells) {
  std::vector<std::string> names;
  std::vector<Column> columns;
  for (const Cell& cell : cells) {
    if (names.empty() || names.back() != cell.case_name) names.push_back(cell.case_name);
    auto column =
        std::find_if(columns.begin(), columns.end(), [&](const Column& c) { return c.heading == cell.metric; });
    if (column == columns.end()) column = columns.insert(columns.end(), {cell.metric, {}, {}});
    column->thesis.push_back(printed(cell));
    column->ours.push_back(ours(cell));
  }
  const std::size_t first = widest(names, 0);
  std::string head(first, ' '), below(first, ' ');
  std::vector<std::string> lines;
  for (const std::string& name : names) lines.push_back(fmt::format("{:<{}}", name, first));
  for (const Column& c : columns) {
    const std::size_t thesis_width = widest(c.thesis, 6);
    const std::size_t ours_width =
        std::max(widest(c.ours, 5), c.heading.size() - std::min(c.heading.size(), thesis_width + 2));
    head += fmt::format("  |{:>{}}", c.heading, thesis_width + ours_width + 3);
    below += fmt::format("  |{:>{}}{:>{}}", "thesis", thesis_width + 1, "ours", ours_width + 2);
    for (std::size_t i = 0; i < lines.size(); ++i)
      lines[i] += fmt::format("  |{:>{}}{:>{}}", c.thesis[i], thesis_width + 1, c.ours[i], ours_width + 2);
  }
  std::string text = head + "\n" + below + "\n";
  for (const std::string& line : lines) text += line + "\n";
  return text;
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

std::string reproduction_json(std::span<const Cell> cells) {
  nlohmann::ordered_json json = {{"cells", nlohmann::ordered_json::array()},
                                 {"agreement", nlohmann::ordered_json::array()}};
  for (const Cell& cell : cells) {
    nlohmann::ordered_json one = {{"table", cell.table},    {"parameters", cell.parameters},
                                  {"case", cell.case_name}, {"metric", cell.metric},
                                  {"thesis", nullptr},      {"ours", number_or_null(cell.ours)}};
    if (cell.thesis) one["thesis"] = cell.thesis->value;
    if (cell.thesis && cell.thesis->upper_bound) one["thesis_bound"] = "<";
    if (cell.runs > 1) {
      one["ours_spread"] = number_or_null(cell.ours_spread);
      one["runs"] = cell.runs;
    }
    json["cells"].push_back(std::move(one));
  }
  for (const Agreement& a : agreements(cells))
    json["agreement"].push_back({{"tables", a.tables},
                                 {"parameters", a.parameters},
                                 {"metric", a.metric},
                                 {"mean_abs_ln", number_or_null(a.mean_abs_ln)},
                                 {"cells", a.cells}});
  return json.dump(2) + "\n";
}

std::string reproduction_csv(std::span<const Cell> cells) {
  std::string text = "table,parameters,case,metric,thesis_bound,thesis,ours,ours_spread,runs\n";
  for (const Cell& c : cells)
    text += fmt::format("{},{},{},{},{},{},{},{},{}\n", c.table, c.parameters, quoted(c.case_name), c.metric,
                        c.thesis && c.thesis->upper_bound ? "<" : "",
                        c.thesis ? fmt::format("{}", c.thesis->value) : "", c.ours, c.ours_spread, c.runs);
  return text;
}

std::string reproduction_text(std::span<const Cell> cells) {
  std::string text, table;
  for (auto from = cells.begin(); from != cells.end();) {
    const auto to = std::find_if(
        from, cells.end(), [&](const Cell& c) { return c.table != from->table || c.parameters != from->parameters; });
    if (from->table != table)
      text += fmt::format("{}{}: {}\n", table.empty() ? "" : "\n", from->table, title_of(from->table));
    table = from->table;
    text += fmt::format("\nparameters {}: {}\n", from->parameters, parameters_in_words(from->parameters));
    text += block_text({from, to});
    from = to;
  }
  const std::vector<Agreement> all = agreements(cells);
  if (!all.empty()) text += "\nmean |ln(ours/thesis)| over the tables above\n";
  for (const Agreement& a : all)
    text += fmt::format("  {:<10} {:<36} {:<24} {:.2f}  ({} cells)\n", a.tables, a.parameters, a.metric, a.mean_abs_ln,
                        a.cells);
  return text;
}

}  // namespace solenoid
