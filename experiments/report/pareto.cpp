#include "experiments/report/pareto.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/plot.hpp"
#include "experiments/report/ranking.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

namespace solenoid {
namespace {

struct Panel {
  const char* label;
  double RankedVariant::*effort;
};
constexpr Panel panels[] = {{"coil switches per second", &RankedVariant::switches_per_s},
                            {"supply air, g a run", &RankedVariant::air_g}};

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

Plot plot_of(std::span<const RunRecord> records) {
  Ranking ranking = rank_variants(records);
  std::erase_if(ranking.variants, [](const RankedVariant& v) { return !v.ranked; });
  if (ranking.variants.empty()) throw ConfigError("no variant finished a scenario, nothing to draw");
  Plot plot{.width = 1280,
            .height = 560,
            .title = fmt::format("RMSE of the true position over {} scenarios: geometric mean and its 95 % interval",
                                 ranking.common_scenarios),
            .layout = "1,2",
            .settings =
                "set logscale y\nset xrange [0:*]\nset offsets graph 0, graph 0.25, 0, 0\n"
                "set ylabel 'RMSE, mm'\nunset key\n"};
  for (const Panel& panel : panels)
    plot.panels.push_back({fmt::format("set xlabel '{}'\n", panel.label),
                           data_of(ranking.variants, panel),
                           {{"index 1 using 1:2 with fsteps lw 1 dt (4,3) lc rgb '#7f7f7f'"},
                            {"index 0 using 1:2:3:4 with yerrorbars pt 7 ps 0.8 lc rgb '#1f77b4'"},
                            {"index 0 using 1:2:5 with labels left offset 0.8,0.3"}}});
  return plot;
}

}  // namespace

void draw_pareto(std::span<const RunRecord> records, const std::string& path) {
  const bool svg = path.ends_with(".svg");
  if (!svg && !path.ends_with(".png")) throw ConfigError(path + ": not a figure's name (allowed: *.svg or *.png)");
  draw(plot_of(records), path, svg ? FigureFormat::svg : FigureFormat::png);
}

}  // namespace solenoid
