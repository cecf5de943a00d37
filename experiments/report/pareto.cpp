#include "experiments/report/pareto.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/gnuplot.hpp"
#include "experiments/report/ranking.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

namespace solenoid {
namespace {

struct Panel {
  const char* file;
  const char* label;
  double RankedVariant::*effort;
};
constexpr Panel panels[] = {{"switches", "coil switches per second", &RankedVariant::switches_per_s},
                            {"air", "supply air, g a run", &RankedVariant::air_g}};

/// Text as a column of a data file, where a string ends with the next double quote.
std::string data_quoted(std::string text) {
  std::ranges::replace(text, '"', '\'');
  return '"' + text + '"';
}

/// Lines `effort rmse low high "name"`, and below them, apart, the front as a staircase.
std::string data_of(std::vector<RankedVariant> variants, const Panel& panel) {
  std::ranges::sort(variants, {}, panel.effort);
  std::string points, front;
  double best = std::numeric_limits<double>::infinity();
  for (const RankedVariant& v : variants) {
    const double effort = v.*panel.effort;
    points += fmt::format("{} {} {} {} {}\n", effort, v.rmse_mm, v.rmse_mm / v.rmse_margin, v.rmse_mm * v.rmse_margin,
                          data_quoted(v.variant));
    if (v.rmse_mm >= best) continue;
    best = v.rmse_mm;
    front += fmt::format("{} {}\n", effort, best);
  }
  return points + "\n\n" + front;
}

std::string script_for(bool svg, std::size_t scenarios) {
  std::string text = fmt::format(R"(set terminal {} noenhanced
set output 'figure'
set encoding utf8
set multiplot layout 1,2 title 'RMSE of the true position over {} scenarios: geometric mean and its 95 % interval'
set logscale y
set grid back lt 1 lw 0.7 lc rgb '#dddddd'
set border 3 lc rgb '#606060'
set tics nomirror out scale 0.5
set xrange [0:*]
set offsets graph 0, graph 0.25, 0, 0
set ylabel 'RMSE, mm'
unset key
)",
                                 svg ? "svg size 1280,560 font 'Helvetica,13' background '#ffffff'"
                                     : "pngcairo size 1280,560 font 'Sans,10' background '#ffffff'",
                                 scenarios);
  for (const Panel& panel : panels)
    text += fmt::format(
        "set xlabel '{0}'\n"
        "plot '{1}' index 1 using 1:2 with fsteps lw 1 dt (4,3) lc rgb '#7f7f7f', "
        "'{1}' index 0 using 1:2:3:4 with yerrorbars pt 7 ps 0.8 lc rgb '#1f77b4', "
        "'{1}' index 0 using 1:2:5 with labels left offset 0.8,0.3\n",
        panel.label, panel.file);
  return text + "unset multiplot\nset output\n";
}

}  // namespace

void draw_pareto(std::span<const RunRecord> records, const std::string& path) {
  const bool svg = path.ends_with(".svg");
  if (!svg && !path.ends_with(".png")) throw ConfigError(path + ": not a figure's name (allowed: *.svg or *.png)");
  Ranking ranking = rank_variants(records);
  std::erase_if(ranking.variants, [](const RankedVariant& v) { return !v.ranked; });
  if (ranking.variants.empty()) throw ConfigError(path + ": no variant finished a scenario, nothing to draw");
  std::map<std::string, std::string> files;
  for (const Panel& panel : panels) files[panel.file] = data_of(ranking.variants, panel);
  draw_with_gnuplot(files, script_for(svg, ranking.common_scenarios), path);
}

}  // namespace solenoid
