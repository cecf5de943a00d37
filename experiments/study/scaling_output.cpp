#include "experiments/study/scaling_output.hpp"

#include "experiments/base/machine.hpp"
#include "experiments/base/text_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

const char* model_name(const ScalingOptions& options) { return options.cylinder ? "cylinder" : "hybrid"; }

struct NamedFigure {
  const char* name;
  double SearchFigures::*value;
};
constexpr NamedFigure search_figures[] = {
    {"nodes_p50", &SearchFigures::nodes_p50}, {"nodes_p99", &SearchFigures::nodes_p99},
    {"nodes_max", &SearchFigures::nodes_max}, {"us_p50", &SearchFigures::us_p50},
    {"us_p99", &SearchFigures::us_p99},       {"us_max", &SearchFigures::us_max},
    {"proven", &SearchFigures::proven}};

Json to_json(const SearchFigures& figures) {
  Json json;
  for (const NamedFigure& f : search_figures) json[f.name] = figures.*f.value;
  return json;
}

Json to_json(const DeadlineFigures& d) {
  const auto gap = [&](double value) { return d.open > 0 ? Json(value) : Json(nullptr); };
  return {{"deadline_ms", d.deadline_ms}, {"proven", d.proven},        {"open", d.open},
          {"gap_p50", gap(d.gap_p50)},    {"gap_p90", gap(d.gap_p90)}, {"gap_max", gap(d.gap_max)}};
}

Json to_json(const ScalingRow& row) {
  Json json = {{"valves", row.valves},
               {"states", row.states},
               {"blocks", row.periods.size()},
               {"periods", row.periods},
               {"sequences", row.leaves},
               {"full_tree", row.full_tree},
               {"enumeration", row.enumeration ? to_json(*row.enumeration) : Json(nullptr)},
               {"cold", to_json(row.cold)},
               {"warm", to_json(row.warm)},
               {"deadlines", Json::array()}};
  for (const DeadlineFigures& d : row.deadlines) json["deadlines"].push_back(to_json(d));
  return json;
}

std::string percent(double share) { return fmt::format("{:.0f}", 100 * share); }

/// A time is a lower bound where the cap cut off solves that it stands for.
std::string time_text(double us) { return us >= 1e3 * solve_cap_ms ? ">50000" : short_number(us); }

std::string times_text(const std::vector<ScalingRow>& rows) {
  constexpr auto left = TextTable::Align::left;
  TextTable table({{"states^blocks", left},
                   {"periods", left},
                   {"full tree"},
                   {"enumeration us"},
                   {"p99"},
                   {"cold nodes"},
                   {"p99"},
                   {"us"},
                   {"p99"},
                   {"warm nodes"},
                   {"p99"},
                   {"us"},
                   {"p99"},
                   {"proven %"}});
  for (const ScalingRow& row : rows) {
    std::vector<std::string> cells = {fmt::format("{}^{}", row.states, row.periods.size()),
                                      fmt::format("{}", fmt::join(row.periods, " ")),
                                      fmt::format("{:.0f}", row.full_tree)};
    cells.push_back(row.enumeration ? short_number(row.enumeration->us_p50) : "-");
    cells.push_back(row.enumeration ? short_number(row.enumeration->us_p99) : "-");
    for (const SearchFigures& f : {row.cold, row.warm})
      for (const std::string& text : {fmt::format("{:.0f}", f.nodes_p50), fmt::format("{:.0f}", f.nodes_p99),
                                      time_text(f.us_p50), time_text(f.us_p99)})
        cells.push_back(text);
    cells.push_back(percent(row.warm.proven));
    table.add_row(cells);
  }
  return table.text(false);
}

std::string deadlines_text(const std::vector<ScalingRow>& rows) {
  std::vector<TextTable::Column> columns = {{"states^blocks", TextTable::Align::left}};
  for (const DeadlineFigures& d : rows.front().deadlines) {
    columns.push_back({fmt::format("{} ms: proven %", d.deadline_ms)});
    columns.push_back({"gap % p50/p90/max"});
  }
  TextTable table(columns);
  for (const ScalingRow& row : rows) {
    std::vector<std::string> cells = {fmt::format("{}^{}", row.states, row.periods.size())};
    for (const DeadlineFigures& d : row.deadlines) {
      cells.push_back(percent(d.proven));
      cells.push_back(
          d.open == 0 ? "-" : fmt::format("{:.0f}/{:.0f}/{:.0f}", 100 * d.gap_p50, 100 * d.gap_p90, 100 * d.gap_max));
    }
    table.add_row(cells);
  }
  return table.text(false);
}

}  // namespace

std::string scaling_json(const ScalingOptions& options, std::span<const ScalingRow> rows) {
  Json json = {{"model", model_name(options)}, {"switching", options.switching}, {"instances", options.instances},
               {"solve_cap_ms", solve_cap_ms}, {"cpu", this_machine().cpu},      {"rows", Json::array()}};
  for (const ScalingRow& row : rows) json["rows"].push_back(to_json(row));
  return json.dump(1) + "\n";
}

std::string scaling_csv(std::span<const ScalingRow> rows) {
  std::string text = "valves,states,blocks,periods,sequences,full_tree";
  for (const char* search : {"enumeration", "cold", "warm"})
    for (const NamedFigure& f : search_figures) text += fmt::format(",{}_{}", search, f.name);
  if (!rows.empty())
    for (const DeadlineFigures& d : rows.front().deadlines)
      for (const char* name : {"proven", "open", "gap_p50", "gap_p90", "gap_max"})
        text += fmt::format(",{}_at_{}_ms", name, d.deadline_ms);
  text += '\n';
  for (const ScalingRow& row : rows) {
    text += fmt::format("{},{},{},{},{},{}", row.valves, row.states, row.periods.size(), fmt::join(row.periods, " "),
                        row.leaves, row.full_tree);
    for (const auto& search : {row.enumeration, std::optional(row.cold), std::optional(row.warm)})
      for (const NamedFigure& f : search_figures) text += search ? fmt::format(",{}", (*search).*f.value) : ",";
    for (const DeadlineFigures& d : row.deadlines)
      text += d.open > 0 ? fmt::format(",{},{},{},{},{}", d.proven, d.open, d.gap_p50, d.gap_p90, d.gap_max)
                         : fmt::format(",{},0,,,", d.proven);
    text += '\n';
  }
  return text;
}

std::string scaling_text(const ScalingOptions& options, std::span<const ScalingRow> rows) {
  if (rows.empty()) return "nothing was finished\n";
  const std::vector<ScalingRow> all(rows.begin(), rows.end());
  return fmt::format(
      "{}, switching weight {:g}, {} recorded states a valve set, one core; medians and 99th percentiles.\n"
      "Blocks in control periods of 5 ms; solves end after {:.0f} ms.\n\n{}\nProven optimal by a deadline, warm; gaps "
      "of "
      "the others.\n\n{}",
      options.cylinder ? "Cylinder alone" : "Cylinder and motor in the prediction", options.switching,
      options.instances, solve_cap_ms, times_text(all), deadlines_text(all));
}

}  // namespace solenoid
