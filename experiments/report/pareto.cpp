#include "experiments/report/pareto.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/gnuplot.hpp"
#include "experiments/base/plot.hpp"
#include "experiments/report/headings.hpp"
#include "experiments/report/ranking.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// Text as a column of a data file, where a string ends with the next double quote.
std::string data_quoted(std::string text) {
  std::ranges::replace(text, '"', '\'');
  return '"' + text + '"';
}

/// Lines `effort error low high "name"`, and below them, apart, the front as a staircase.
std::string points_of(std::vector<RankedVariant> variants, std::size_t effort) {
  std::ranges::sort(variants, {}, [&](const RankedVariant& v) { return v.efforts[effort]; });
  std::string points, front;
  double best = std::numeric_limits<double>::infinity();
  for (const RankedVariant& v : variants) {
    points += fmt::format("{} {} {} {} {}\n", v.efforts[effort], v.error, v.error / v.margin, v.error * v.margin,
                          data_quoted(v.variant));
    if (v.error >= best) continue;
    best = v.error;
    front += fmt::format("{} {}\n", v.efforts[effort], best);
  }
  return points + "\n\n" + front;
}

Plot pareto_plot(Ranking ranking) {
  std::erase_if(ranking.variants, [](const RankedVariant& v) { return !v.ranked; });
  if (ranking.variants.empty()) throw ConfigError("no variant finished a scenario, nothing to draw");
  const std::vector<MetricColumn> efforts = effort_metrics(*ranking.system);
  if (efforts.empty())
    throw ConfigError(fmt::format("the system '{}' has no effort to draw errors against", ranking.system->name));
  const MetricHeading judged = metric_heading(judged_metric(*ranking.system));
  Plot plot{.width = 640 * static_cast<int>(efforts.size()),
            .height = 560,
            .title = fmt::format("{}, {}, over {} scenarios: geometric mean and its 95 % interval", judged.label,
                                 ranking.system->judged.error, ranking.common_scenarios),
            .layout = fmt::format("1,{}", efforts.size()),
            .settings = fmt::format("set logscale y\nset xrange [0:*]\nset offsets graph 0, graph 0.25, 0, 0\n"
                                    "set ylabel {}\nunset key\n",
                                    gnuplot_quoted(judged.with_unit()))};
  for (std::size_t i = 0; i < efforts.size(); ++i)
    plot.panels.push_back({fmt::format("set xlabel {}\n", gnuplot_quoted(metric_heading(efforts[i]).with_unit())),
                           points_of(ranking.variants, i),
                           {{"index 1 using 1:2 with fsteps lw 1 dt (4,3) lc rgb '#7f7f7f'"},
                            {"index 0 using 1:2:3:4 with yerrorbars pt 7 ps 0.8 lc rgb '#1f77b4'"},
                            {"index 0 using 1:2:5 with labels left offset 0.8,0.3"}}});
  return plot;
}

}  // namespace

void draw_ranked(Ranking ranking, const std::string& path) {
  const bool svg = path.ends_with(".svg");
  if (!svg && !path.ends_with(".png")) throw ConfigError(path + ": not a figure's name (allowed: *.svg or *.png)");
  draw(pareto_plot(std::move(ranking)), path, svg ? FigureFormat::svg : FigureFormat::png);
}

void draw_pareto(std::span<const RunRecord> records, const std::string& path) {
  draw_ranked(rank_variants(records), path);
}

}  // namespace solenoid
