#include "experiments/base/gnuplot.hpp"
#include "experiments/base/result.hpp"
#include "experiments/study/sweep.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

using Column = Table::Column;

std::string value_text(std::optional<double> value) { return value ? fmt::format("{}", *value) : "-"; }

/// What a row is for where it is for a condition: "payload", the separator, "kg".
std::string condition_label(const Study& study, const char* separator) {
  const Signal& first = study.campaign.system->description().conditions.front();
  return first.unit.empty() ? first.label : first.label + separator + first.unit;
}

Table table_of(const Study& study, const StudyTable& table, const StudyRows& rows) {
  Table shown{.name = table.name,
              .title = table.title,
              .columns = {Column("variant", "variant", "<"), Column("value"),
                          Column("", table.across_conditions ? condition_label(study, " ") : study.sweep.key),
                          Column("runs"), Column("bad")}};
  for (const std::string& figure : table.figures) shown.columns.push_back({figure, figure});
  if (table.knee) {
    shown.columns.push_back({"to_best", "to best"});
    shown.columns.push_back({"knee"});
  }
  shown.columns.push_back({"", "bad runs"});
  for (const StudyPoint& p : rows) {
    Table::Row cells = {p.series, p.value, value_text(p.value), p.runs, p.bad};
    for (const double figure : p.figures) cells.push_back(figure);
    if (table.knee) {
      cells.push_back({p.to_best, p.knee});
      cells.push_back(p.knee);
    }
    cells.push_back(fmt::format("{} of {}", p.bad, p.runs));
    shown.add(std::move(cells));
    if (table.knee && p.knee)
      shown.notes.push_back(
          fmt::format("Knee of {} against {}, {}: {} = {}, {:.3f} from the best in both{}.", table.knee->y,
                      table.knee->x, p.series, study.sweep.key, *p.value, *p.to_best,
                      table.knee->among.empty() ? "" : fmt::format(", among {}", fmt::join(table.knee->among, " "))));
  }
  return shown;
}

/// A figure at equal values of another, a line a series and a column a value.
Table read_off(const StudyTable& table, const StudyRows& rows) {
  Table shown{
      .title = fmt::format("{}: {} at equal {}, between neighbours of a series", table.title, table.at->y, table.at->x),
      .columns = {Column("", "variant", "<")}};
  for (const double x : table.at->values) shown.columns.push_back({"", fmt::format("{:g}", x)});
  std::vector<std::string> series;
  for (const StudyPoint& p : rows)
    if (!std::ranges::count(series, p.series)) series.push_back(p.series);
  for (const std::string& name : series) {
    Table::Row cells = {name};
    for (const double x : table.at->values) {
      const std::optional<double> y = read_at(table, rows, name, x);
      cells.push_back(y ? Json(*y) : Json());
    }
    shown.add(std::move(cells));
  }
  return shown;
}

/// The same as JSON has it.
Json read_off_json(const StudyTable& table, const StudyRows& rows) {
  Json json = {{"x", table.at->x}, {"y", table.at->y}, {"rows", Json::array()}};
  for (const StudyPoint& p : rows) {
    if (&p != &*std::ranges::find(rows, p.series, &StudyPoint::series)) continue;
    for (const double x : table.at->values)
      if (const auto y = read_at(table, rows, p.series, x))
        json["rows"].push_back({{"variant", p.series}, {"at", x}, {"y", *y}});
  }
  return json;
}

std::string point_name(const StudyPoint& p) { return p.value ? fmt::format("{} at {}", p.series, *p.value) : p.series; }

double figure_of(const StudyTable& table, const StudyPoint& p, const std::string& name) {
  return p.figures[static_cast<std::size_t>(std::ranges::find(table.figures, name) - table.figures.begin())];
}

/// Who is on each front, a line a point.
Table fronts_table(const Study& study, const StudyTable& table, const StudyRows& rows) {
  const std::string& y = table.fronts->y;
  Table shown{.title = fmt::format("{}: fronts of {}", table.title, y),
              .columns = {Column("", "against", "<"), Column("", "point", "<"), Column("", "there"), Column("", y)}};
  for (const std::string& x : table.fronts->x)
    for (const StudyPoint* p : front_of(study, table, rows, x, y))
      shown.add({x, point_name(*p), figure_of(table, *p, x), figure_of(table, *p, y)});
  return shown;
}

Json fronts_json(const Study& study, const StudyTable& table, const StudyRows& rows) {
  const std::string& y = table.fronts->y;
  Json json = Json::array();
  for (const std::string& x : table.fronts->x) {
    Json points = Json::array();
    for (const StudyPoint* p : front_of(study, table, rows, x, y))
      points.push_back({{"variant", p->series},
                        {"value", p->value ? Json(*p->value) : Json()},
                        {"x", figure_of(table, *p, x)},
                        {"y", figure_of(table, *p, y)}});
    json.push_back({{"x", x}, {"y", y}, {"points", std::move(points)}});
  }
  return json;
}

std::string label_of(const Study& study, const StudyTable& table, const std::string& name) {
  const SystemDescription& system = study.campaign.system->description();
  if (name == "value" && table.across_conditions) return condition_label(study, ", ");
  if (name == "value") return study.sweep.label;
  const std::vector<StudyFigure> figures = study_figures(system);
  return std::ranges::find(figures, name, &StudyFigure::name)->label;
}

/// Where a point is on an axis; NaN if nowhere.
double coordinate(const Study& study, const StudyTable& table, const StudyPoint& point, const std::string& name) {
  if (name != "value") return figure_of(table, point, name);
  if (!point.value) return std::nan("");
  if (table.across_conditions) return *point.value;
  const auto at = std::ranges::find(study.sweep.values, *point.value);
  if (at == study.sweep.values.end()) return *point.value;  // a printed table's own
  return study.sweep.drawn[static_cast<std::size_t>(at - study.sweep.values.begin())];
}

/// A curve a series; rings around the knees, and each value's name beside its point where the axes are two figures.
Plot::Panel panel_of(const Study& study, const StudyPanel& panel, const StudyTable& table, const StudyRows& rows) {
  Plot::Panel drawn{
      fmt::format("unset logscale\n{}set title {}\nset xlabel {}\nset ylabel {}\n",
                  panel.log.empty() ? "" : "set logscale " + panel.log + "\n", gnuplot_quoted(table.title),
                  gnuplot_quoted(label_of(study, table, panel.x)), gnuplot_quoted(label_of(study, table, panel.y))),
      "",
      {}};
  int blocks = 0;
  const auto add = [&](const std::string& lines, const std::string& how, const std::string& title = "") {
    drawn.data += lines + "\n\n";
    drawn.curves.push_back({fmt::format("index {} using {}", blocks++, how), title});
  };
  std::vector<std::string> series;
  for (const StudyPoint& p : rows)
    if (!std::ranges::count(series, p.series)) series.push_back(p.series);
  for (std::size_t i = 0; i < series.size(); ++i) {
    std::string lines, knees;
    bool swept = false;
    for (const StudyPoint& p : rows) {
      const double x = coordinate(study, table, p, panel.x), y = coordinate(study, table, p, panel.y);
      if (p.series != series[i] || !std::isfinite(x) || !std::isfinite(y)) continue;
      swept = swept || p.value;
      lines += fmt::format("{} {} \"{}\"\n", x, y, p.value ? value_text(p.value) : "");
      if (p.knee) knees += fmt::format("{} {}\n", x, y);
    }
    if (lines.empty()) continue;
    const std::string colour = plot_colour(i);
    add(lines,
        fmt::format("1:2 with {} lc rgb '{}'", swept ? "linespoints pt 7 ps 0.6 lw 1.6" : "points pt 9 ps 1.1", colour),
        series[i]);
    if (!knees.empty()) add(knees, fmt::format("1:2 with points pt 6 ps 2 lw 2 lc rgb '{}'", colour));
    if (table.knee && panel.x != "value")
      add(lines, fmt::format("1:2:3 with labels left offset 0.6,0.4 font ',9' tc rgb '{}'", colour));
  }
  return drawn;
}

Plot plot_of(const Study& study, std::span<const StudyRows> rows) {
  Plot plot{.title = study.title, .settings = "set format '%g'\nset key below maxrows 3 samplen 1.5\n"};
  for (const StudyPanel& panel : study.panels) {
    const auto table = std::ranges::find(study.tables, panel.table, &StudyTable::name);
    plot.panels.push_back(panel_of(study, panel, *table, rows[static_cast<std::size_t>(table - study.tables.begin())]));
    if (plot.panels.back().curves.empty()) plot.panels.pop_back();
  }
  const int count = static_cast<int>(plot.panels.size()), columns = count <= 3 ? count : (count + 1) / 2,
            lines = count <= 3 ? 1 : 2;
  plot.width = std::max(640, 480 * columns);
  plot.height = 440 * lines;
  plot.layout = fmt::format("{},{}", lines, std::max(columns, 1));
  return plot;
}

}  // namespace

Result result_of(const Study& study, std::span<const StudyRows> rows) {
  Result result{
      .title = study.title,
      .facts = {{"study", study.name}, {"title", study.title}, {"key", study.sweep.key}, {"tables", Json::array()}},
      .flat = Table{.columns = {Column("table"), Column("variant"), Column("value"), Column("runs"), Column("bad"),
                                Column("figure"), Column("number")}},
      .plot = plot_of(study, rows)};
  for (std::size_t t = 0; t < rows.size(); ++t) {
    Table table = table_of(study, study.tables[t], rows[t]);
    result.facts["tables"].push_back({{"name", table.name}, {"title", table.title}, {"rows", table.json()}});
    for (const StudyPoint& p : rows[t])
      for (std::size_t i = 0; i < p.figures.size(); ++i)
        result.flat->add({table.name, p.series, p.value, p.runs, p.bad, study.tables[t].figures[i], p.figures[i]});
    table.name.clear();  // it is among the facts already
    result.tables.push_back(std::move(table));
    if (study.tables[t].at) {
      result.facts["tables"].back()["at"] = read_off_json(study.tables[t], rows[t]);
      result.tables.push_back(read_off(study.tables[t], rows[t]));
    }
    if (study.tables[t].fronts) {
      result.facts["tables"].back()["fronts"] = fronts_json(study, study.tables[t], rows[t]);
      result.tables.push_back(fronts_table(study, study.tables[t], rows[t]));
    }
  }
  return result;
}

}  // namespace solenoid
