#include "experiments/base/gnuplot.hpp"
#include "experiments/study/sweep.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr const char* colours[] = {"#1f77b4", "#d95f02", "#2ca02c", "#7570b3",
                                   "#e7298a", "#66a61e", "#a6761d", "#444444"};

std::string label_of(const Study& study, const StudyTable& table, const std::string& name) {
  if (name == "value") return table.across_payloads ? "payload, kg" : study.sweep.label;
  return std::ranges::find(study_figures(), name, [](const StudyFigure& f) { return std::string(f.name); })->label;
}

/// Where a point is on an axis; NaN if nowhere.
double coordinate(const Study& study, const StudyTable& table, const StudyPoint& point, const std::string& name) {
  if (name != "value") {
    const auto at = std::ranges::find(table.figures, name) - table.figures.begin();
    return point.figures[static_cast<std::size_t>(at)];
  }
  if (!point.value) return std::nan("");
  if (table.across_payloads) return *point.value;
  const auto at = std::ranges::find(study.sweep.values, *point.value);
  if (at == study.sweep.values.end()) return *point.value;  // a printed table's own
  return study.sweep.drawn[static_cast<std::size_t>(at - study.sweep.values.begin())];
}

struct Drawing {
  std::string data;
  std::vector<std::string> plots;
  int blocks = 0;
};

/// One more block of data and how it is drawn.
void add(Drawing& drawing, const std::string& file, const std::string& lines, const std::string& style) {
  drawing.data += lines + "\n\n";
  drawing.plots.push_back(fmt::format("'{}' index {} {}", file, drawing.blocks++, style));
}

/// Rings around the knees, each value's name beside its point where the axes are two figures.
void add_marks(Drawing& drawing, const std::string& file, const std::string& lines, const std::string& knees,
               const std::string& colour, bool named) {
  if (!knees.empty())
    add(drawing, file, knees, fmt::format("using 1:2 with points pt 6 ps 2 lw 2 lc rgb '{}' notitle", colour));
  if (named)
    add(drawing, file, lines,
        fmt::format("using 1:2:3 with labels left offset 0.6,0.4 font ',9' tc rgb '{}' notitle", colour));
}

Drawing drawing_of(const Study& study, const StudyPanel& panel, const std::string& file, const StudyTable& table,
                   const StudyRows& rows) {
  Drawing drawing;
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
      lines += fmt::format("{} {} \"{}\"\n", x, y, p.value ? fmt::format("{}", *p.value) : "");
      if (p.knee) knees += fmt::format("{} {}\n", x, y);
    }
    if (lines.empty()) continue;
    const std::string colour = colours[i % std::size(colours)];
    add(drawing, file, lines,
        fmt::format("using 1:2 with {} lc rgb '{}' title {}",
                    swept ? "linespoints pt 7 ps 0.6 lw 1.6" : "points pt 9 ps 1.1", colour,
                    gnuplot_quoted(series[i])));
    add_marks(drawing, file, lines, knees, colour, table.knee && panel.x != "value");
  }
  return drawing;
}

std::string script_of(const Study& study, const std::vector<Drawing>& drawings, FigureFormat format) {
  const int count = static_cast<int>(drawings.size()), columns = count <= 3 ? count : (count + 1) / 2,
            lines = count <= 3 ? 1 : 2;
  std::string text = fmt::format(
      R"(set terminal {} size {},{} font '{}' background '#ffffff' noenhanced
set output 'figure'
set encoding utf8
set multiplot layout {},{} title {}
set grid back lt 1 lw 0.7 lc rgb '#dddddd'
set border 3 lc rgb '#606060'
set tics nomirror out scale 0.5
set format '%g'
set key below maxrows 3 samplen 1.5
)",
      format == FigureFormat::svg ? "svg" : "pngcairo", std::max(640, 480 * columns), 440 * lines,
      format == FigureFormat::svg ? "Helvetica,12" : "Sans,10", lines, columns, gnuplot_quoted(study.title));
  for (std::size_t i = 0; i < drawings.size(); ++i) {
    const StudyPanel& panel = study.panels[i];
    const StudyTable& table = *std::ranges::find(study.tables, panel.table, &StudyTable::name);
    if (drawings[i].plots.empty()) continue;
    text += "unset logscale\n" + (panel.log.empty() ? "" : "set logscale " + panel.log + "\n");
    text += fmt::format("set title {}\nset xlabel {}\nset ylabel {}\nplot {}\n", gnuplot_quoted(table.title),
                        gnuplot_quoted(label_of(study, table, panel.x)),
                        gnuplot_quoted(label_of(study, table, panel.y)), fmt::join(drawings[i].plots, ", \\\n     "));
  }
  return text + "unset multiplot\nset output\n";
}

}  // namespace

void draw_study(const Study& study, std::span<const StudyRows> rows, const std::string& path, FigureFormat format) {
  std::map<std::string, std::string> files;
  std::vector<Drawing> drawings;
  for (const StudyPanel& panel : study.panels) {
    const auto table = std::ranges::find(study.tables, panel.table, &StudyTable::name);
    const std::string file = fmt::format("panel{}", drawings.size());
    drawings.push_back(
        drawing_of(study, panel, file, *table, rows[static_cast<std::size_t>(table - study.tables.begin())]));
    files[file] = drawings.back().data;
  }
  draw_with_gnuplot(files, script_of(study, drawings, format), path);
}

}  // namespace solenoid
