#include "experiments/base/plot.hpp"

#include "experiments/base/gnuplot.hpp"

#include <fmt/format.h>

namespace solenoid {
namespace {

bool of_data(const std::string& what) { return what.starts_with("using ") || what.starts_with("index "); }

std::string heading_of(const Plot& plot, FigureFormat format) {
  std::string text = fmt::format(
      R"(set terminal {} size {},{} font {} background '#ffffff' noenhanced
set output 'figure'
set encoding utf8
set grid back lt 1 lw 0.7 lc rgb '#dddddd'
set border 3 lc rgb '#606060'
set tics nomirror out scale 0.5
)",
      format == FigureFormat::svg ? "svg" : "pngcairo", plot.width, plot.height,
      format == FigureFormat::svg ? "'Helvetica,13'" : "'Sans,10'");
  const std::string title = plot.title.empty() ? "" : " title " + gnuplot_quoted(plot.title);
  if (!plot.layout.empty())
    text += fmt::format("set multiplot{} layout {}\n", title, plot.layout);
  else if (!title.empty())
    text += "set" + title + "\n";
  return text + plot.settings;
}

}  // namespace

const char* plot_colour(std::size_t n) {
  constexpr const char* colours[] = {"#1f77b4", "#d95f02", "#2ca02c", "#7570b3",
                                     "#e7298a", "#66a61e", "#a6761d", "#444444"};
  return colours[n % std::size(colours)];
}

void draw(const Plot& plot, const std::string& path, FigureFormat format) {
  std::map<std::string, std::string> files;
  std::string script = heading_of(plot, format);
  for (const Plot::Panel& panel : plot.panels) {
    const std::string file = fmt::format("panel{}", files.size());
    files[file] = panel.data;
    script += panel.settings;
    std::string between = "plot ";
    for (const Plot::Curve& curve : panel.curves) {
      script += between + (of_data(curve.what) ? fmt::format("'{}' ", file) : "") + curve.what +
                (curve.title.empty() ? " notitle" : " title " + gnuplot_quoted(curve.title));
      between = ", \\\n     ";
    }
    script += "\n";
  }
  draw_with_gnuplot(files, script + (plot.layout.empty() ? "" : "unset multiplot\n") + "set output\n", path);
}

}  // namespace solenoid
