#include "experiments/base/gnuplot.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/base/result.hpp"
#include "experiments/study/scaling.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Column = Table::Column;
using Data = Table::Data;

struct NamedFigure {
  const char *name, *heading, *format;
  double SearchFigures::*value;
};
constexpr NamedFigure search_figures[] = {{"nodes_p50", "nodes", ".0f", &SearchFigures::nodes_p50},
                                          {"nodes_p99", "p99", ".0f", &SearchFigures::nodes_p99},
                                          {"nodes_max", "", "", &SearchFigures::nodes_max},
                                          {"us_p50", "us", "", &SearchFigures::us_p50},
                                          {"us_p99", "p99", "", &SearchFigures::us_p99},
                                          {"us_max", "", "", &SearchFigures::us_max},
                                          {"proven", "proven %", ".0f%", &SearchFigures::proven}};

std::string tree_name(const ScalingRow& row) { return fmt::format("{}^{}", row.states, row.periods.size()); }

/// An object of a deadline's numbers, as JSON has them.
Json to_json(const DeadlineFigures& d) {
  const auto gap = [&](double value) { return d.open > 0 ? Json(value) : Json(); };
  return {{"deadline_ms", d.deadline_ms}, {"proven", d.proven},        {"open", d.open},
          {"gap_p50", gap(d.gap_p50)},    {"gap_p90", gap(d.gap_p90)}, {"gap_max", gap(d.gap_max)}};
}

/// Each search's numbers, of which a person sees those that tell.
Table searches(const SystemDescription& system, std::span<const ScalingRow> rows) {
  Table table{
      .name = "rows",
      .columns = {Column(system.modes_key), Column("states"), Column("blocks"), Column("", "states^blocks", "<"),
                  Column("periods", "periods", "<"), Column("sequences"), Column("full_tree", "full tree", ".0f")}};
  for (const std::string search : {"enumeration", "cold", "warm"}) {
    table.columns.push_back({search, "", "", Data::json});  // null where there is none
    for (const NamedFigure& f : search_figures) {
      const std::string name = f.name;
      const bool hidden = search == "enumeration" ? !name.starts_with("us_") : name == "proven" && search != "warm";
      const std::string before = name.ends_with("_p50") ? search + " " : "";
      table.columns.push_back(
          {search + "." + name + "?", hidden || *f.heading == 0 ? "" : before + f.heading, f.format});
    }
  }
  table.columns.push_back({"deadlines", "", "", Data::json});
  if (!rows.empty())
    for (const DeadlineFigures& d : rows.front().deadlines)
      for (const char* name : {"proven", "open", "gap_p50", "gap_p90", "gap_max"})
        table.columns.push_back({fmt::format("{}_at_{:g}_ms", name, d.deadline_ms), "", "", Data::csv});
  for (const ScalingRow& row : rows) {
    Table::Row cells = {row.mode_set, row.states, row.periods.size(), tree_name(row),
                        row.periods,  row.leaves, row.full_tree};
    for (const auto& search : {row.enumeration, std::optional(row.cold), std::optional(row.warm)}) {
      cells.push_back(nullptr);
      for (const NamedFigure& f : search_figures) cells.push_back(search ? Json((*search).*f.value) : Json());
    }
    Json deadlines = Json::array();
    for (const DeadlineFigures& d : row.deadlines) deadlines.push_back(to_json(d));
    cells.push_back(deadlines);
    for (const Json& d : deadlines)
      for (const char* name : {"proven", "open", "gap_p50", "gap_p90", "gap_max"}) cells.push_back(d.at(name));
    table.add(std::move(cells));
  }
  return table;
}

Table deadlines(std::span<const ScalingRow> rows) {
  Table table{.title = "Proven optimal by a deadline, warm; gaps of the others.",
              .columns = {{"", "states^blocks", "<"}}};
  if (rows.empty()) return table;
  for (const DeadlineFigures& d : rows.front().deadlines) {
    table.columns.push_back({"", fmt::format("{:g} ms: proven %", d.deadline_ms), ".0f%"});
    table.columns.push_back({"", "gap % p50/p90/max"});
  }
  for (const ScalingRow& row : rows) {
    Table::Row cells = {tree_name(row)};
    for (const DeadlineFigures& d : row.deadlines) {
      cells.push_back(d.proven);
      cells.push_back(
          d.open == 0 ? "-" : fmt::format("{:.0f}/{:.0f}/{:.0f}", 100 * d.gap_p50, 100 * d.gap_p90, 100 * d.gap_max));
    }
    table.add(std::move(cells));
  }
  return table;
}

/// Columns: 1 blocks, 2 enumeration us, 3 cold us, 4 warm us, 5 warm us p99, 6 full tree, 7 cold nodes, 8 warm nodes,
/// 9 warm nodes p99, 10.. percent proven by each deadline.
std::string data_of(std::span<const ScalingRow> rows, const std::string& mode_set) {
  std::string text;
  for (const ScalingRow& row : rows) {
    if (row.mode_set != mode_set) continue;
    text += fmt::format("{} {} {} {} {} {} {} {} {}", row.periods.size(),
                        row.enumeration ? fmt::format("{:.4g}", row.enumeration->us_p50) : "NaN", row.cold.us_p50,
                        row.warm.us_p50, row.warm.us_p99, row.full_tree, row.cold.nodes_p50, row.warm.nodes_p50,
                        row.warm.nodes_p99);
    for (const DeadlineFigures& d : row.deadlines) text += fmt::format(" {}", 100 * d.proven);
    text += '\n';
  }
  return text;
}

/// The three plots of one mode set; the first column carries the labels, the last one the keys.
void add_column(Plot& plot, const std::string& heading, const std::string& data, bool first, bool last,
                const std::vector<DeadlineFigures>& deadlines) {
  constexpr const char* blues[] = {"#c6dbef", "#9ecae1", "#6baed6", "#3182bd", "#08519c"};
  const auto label = [&](const char* text) { return fmt::format("set ylabel '{}'\n", first ? text : ""); };
  const auto tics = [&](const char* labelled) {
    return fmt::format("set ytics ({})\n", first ? labelled : "'' 10, '' 100, '' 1e3, '' 1e4, '' 1e5, '' 1e6, '' 1e7");
  };
  const auto curve = [](int column, const char* colour) {
    return fmt::format("using 1:{} with linespoints pt {} ps {} lw 1.5 lc rgb '{}'", column, colour[1] == 'f' ? 4 : 7,
                       colour[1] == 'f' ? 0.8 : 0.6, colour);
  };
  const auto tail = [](int column) {
    return fmt::format("using 1:{} with lines lw 1.2 dt (3,3) lc rgb '#1f77b4'", column);
  };
  const double period_ms = deadlines.empty() ? 1.0 : deadlines.back().deadline_ms;
  const char *grey = "#7f7f7f", *orange = "#ff7f0e", *blue = "#1f77b4";
  plot.panels.push_back(
      {fmt::format(
           "set title {} offset 0,-0.6\nset logscale y\nset format x ''\nunset xlabel\nset yrange [{}:2e5]\n{}{}",
           gnuplot_quoted(heading), period_ms < 1 ? 0.3 : 3.0,
           tics("'10 us' 10, '100 us' 100, '1 ms' 1e3, '10 ms' 1e4, '100 ms' 1e5"), label("time to the proof")) +
           (last ? "set key at screen 0.995, graph 0.98 right vertical reverse Left samplen 1.5\n" : "unset key\n"),
       data,
       {{fmt::format("{} with lines lw 1 dt (6,4) lc rgb '#d62728'", 1e3 * period_ms),
         fmt::format("{:g} ms", period_ms)},
        {curve(2, grey), "enumeration"},
        {curve(3, orange), "cold"},
        {curve(4, blue), "warm"},
        {tail(5), "warm, p99"}}});
  plot.panels.push_back(
      {"unset title\nset yrange [1:1e8]\n" +
           tics("'1' 1, '10' 10, '100' 100, '10³' 1e3, '10⁴' 1e4, '10⁵' 1e5, '10⁶' 1e6, '10⁷' 1e7, '10⁸' 1e8") +
           label("nodes"),
       data,
       {{curve(6, grey), "whole tree"}, {curve(7, orange), "cold"}, {curve(8, blue), "warm"}, {tail(9), "warm, p99"}}});
  plot.panels.push_back(
      {fmt::format("unset logscale y\nset yrange [0:105]\nset ytics 20\nset format y{}\n{}set format x "
                   "'%g'\nset xlabel 'blocks'\n",
                   first ? "" : " ''", label("proven optimal [%]")),
       data,
       {}});
  for (std::size_t d = 0; d < deadlines.size(); ++d)
    plot.panels.back().curves.push_back(
        {curve(static_cast<int>(10 + d), blues[d % 5]), fmt::format("in {:g} ms", deadlines[d].deadline_ms)});
}

Plot plot_of(const ScalingOptions& options, std::span<const ScalingRow> rows) {
  Plot plot{.width = 1280,
            .height = 860,
            .title = fmt::format("{}, {} recorded states, one core", options.title, options.instances),
            .settings = fmt::format("set xrange [0.7:{}.3]\nset xtics 1\n", most_blocks)};
  std::vector<const ScalingRow*> sets;  // the first row of each mode set
  for (const ScalingRow& row : rows)
    if (sets.empty() || sets.back()->mode_set != row.mode_set) sets.push_back(&row);
  plot.layout = fmt::format(
      "3,{} columnsfirst margins screen 0.075, screen 0.855, screen 0.065, screen 0.925 spacing screen 0.022, screen "
      "0.03",
      std::max<std::size_t>(1, sets.size()));
  for (const ScalingRow* set : sets)
    add_column(plot, fmt::format("{} states ({})", set->states, set->mode_set), data_of(rows, set->mode_set),
               set == sets.front(), set == sets.back(), set->deadlines);
  return plot;
}

}  // namespace

Result result_of(const ScalingOptions& options, std::span<const ScalingRow> rows) {
  const SystemDescription& system = options.system->description();
  return {.title = fmt::format("{}, {} recorded states a mode set, one core; medians and 99th percentiles.\n"
                               "Blocks in control periods of {:g} ms; solves end after {:.0f} ms.",
                               options.title, options.instances, 1e3 * system.timing.period_s(), solve_cap_ms),
          .facts = {{"system", system.name},
                    {"model", options.model},
                    {"instances", options.instances},
                    {"solve_cap_ms", solve_cap_ms},
                    {"cpu", this_machine().cpu}},
          .tables = {searches(system, rows), deadlines(rows)},
          .plot = plot_of(options, rows)};
}

}  // namespace solenoid
