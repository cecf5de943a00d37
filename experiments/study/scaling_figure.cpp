#include "experiments/base/files.hpp"
#include "experiments/base/gnuplot.hpp"
#include "experiments/study/scaling_output.hpp"

#include <limits>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// Columns: 1 blocks, 2 enumeration us, 3 cold us, 4 warm us, 5 warm us p99, 6 full tree, 7 cold nodes, 8 warm nodes,
/// 9 warm nodes p99, 10.. percent proven by each deadline.
std::string data_of(std::span<const ScalingRow> rows, const std::string& valves) {
  std::string text;
  for (const ScalingRow& row : rows) {
    if (row.valves != valves) continue;
    text += fmt::format("{} {} {} {} {} {} {} {} {}", row.periods.size(),
                        row.enumeration ? fmt::format("{:.4g}", row.enumeration->us_p50) : "NaN", row.cold.us_p50,
                        row.warm.us_p50, row.warm.us_p99, row.full_tree, row.cold.nodes_p50, row.warm.nodes_p50,
                        row.warm.nodes_p99);
    for (const DeadlineFigures& d : row.deadlines) text += fmt::format(" {}", 100 * d.proven);
    text += '\n';
  }
  return text;
}

std::string settings_text(const ScalingOptions& options, ScalingFigureFormat format) {
  const bool svg = format == ScalingFigureFormat::svg;
  const std::string title = fmt::format("{}, horizon 100 ms, switching weight {:g}, {} recorded states, one core",
                                        options.cylinder ? "Cylinder alone" : "Cylinder and motor in the prediction",
                                        options.switching, options.instances);
  return fmt::format(R"(set terminal {} noenhanced
set output 'figure'
set encoding utf8
set multiplot layout 3,3 columnsfirst title {} margins screen 0.075, screen 0.855, screen 0.065, screen 0.925 spacing screen 0.022, screen 0.03
set xrange [0.7:{}.3]
set xtics 1
set grid xtics ytics back lt 1 lw 0.7 lc rgb '#dddddd'
set border 3 lc rgb '#606060'
set tics nomirror out scale 0.5
unset key
)",
                     svg ? "svg size 1280,860 font 'Helvetica,13' background '#ffffff'"
                         : "pngcairo size 1280,860 font 'Sans,10' background '#ffffff'",
                     gnuplot_quoted(title), most_blocks);
}

constexpr const char* time_tics = "'10 us' 10, '100 us' 100, '1 ms' 1e3, '10 ms' 1e4, '100 ms' 1e5";
constexpr const char* node_tics =
    "'1' 1, '10' 10, '100' 100, '10³' 1e3, '10⁴' 1e4, '10⁵' 1e5, '10⁶' 1e6, '10⁷' 1e7, '10⁸' 1e8";

/// The three plots of one valve set; the first column carries the labels, the last one the keys.
std::string column_text(const std::string& heading, const std::string& data, bool first, bool last,
                        const std::vector<DeadlineFigures>& deadlines) {
  const char* colours[] = {"#c6dbef", "#9ecae1", "#6baed6", "#3182bd", "#08519c"};
  const auto key =
      last ? "set key at screen 0.995, graph 0.98 right vertical reverse Left samplen 1.5\n" : "unset key\n";
  const auto label = [&](const char* text) { return fmt::format("set ylabel '{}'\n", first ? text : ""); };
  const auto tics = [&](const char* labelled) {
    return fmt::format("set ytics ({})\n", first ? labelled : "'' 10, '' 100, '' 1e3, '' 1e4, '' 1e5, '' 1e6, '' 1e7");
  };
  const std::string plain_y = first ? "set format y\n" : "set format y ''\n";
  std::string text = fmt::format(
      "set title {} offset 0,-0.6\nset logscale y\nset format x ''\nunset xlabel\nset yrange [3:2e5]\n{}{}{}"
      "plot 5000 with lines lw 1 dt (6,4) lc rgb '#d62728' title '5 ms', "
      "'{}' using 1:2 with linespoints pt 7 ps 0.6 lw 1.5 lc rgb '#7f7f7f' title 'enumeration', "
      "'' using 1:3 with linespoints pt 4 ps 0.8 lw 1.5 lc rgb '#ff7f0e' title 'cold', "
      "'' using 1:4 with linespoints pt 7 ps 0.6 lw 1.5 lc rgb '#1f77b4' title 'warm', "
      "'' using 1:5 with lines lw 1.2 dt (3,3) lc rgb '#1f77b4' title 'warm, p99'\n",
      gnuplot_quoted(heading), tics(time_tics), label("time to the proof"), key, data);
  text += fmt::format(
      "unset title\nset yrange [1:1e8]\n{}{}"
      "plot '{}' using 1:6 with linespoints pt 7 ps 0.6 lw 1.5 lc rgb '#7f7f7f' title 'whole tree', "
      "'' using 1:7 with linespoints pt 4 ps 0.8 lw 1.5 lc rgb '#ff7f0e' title 'cold', "
      "'' using 1:8 with linespoints pt 7 ps 0.6 lw 1.5 lc rgb '#1f77b4' title 'warm', "
      "'' using 1:9 with lines lw 1.2 dt (3,3) lc rgb '#1f77b4' title 'warm, p99'\n",
      tics(node_tics), label("nodes"), data);
  text += fmt::format(
      "unset logscale y\nset yrange [0:105]\nset ytics 20\n{}{}set format x '%g'\nset xlabel 'blocks'\nplot ", plain_y,
      label("proven optimal [%]"));
  for (std::size_t d = 0; d < deadlines.size(); ++d)
    text += fmt::format("{}'{}' using 1:{} with linespoints pt 7 ps 0.6 lw 1.8 lc rgb '{}' title 'in {} ms'",
                        d ? ", " : "", data, 10 + d, colours[d % 5], deadlines[d].deadline_ms);
  return text + "\n";
}

}  // namespace

void draw_scaling(const ScalingOptions& options, std::span<const ScalingRow> rows, const std::string& path,
                  ScalingFigureFormat format) {
  std::map<std::string, std::string> files;
  std::string script = settings_text(options, format);
  std::vector<const ScalingRow*> sets;  // the first row of each valve set
  for (const ScalingRow& row : rows)
    if (sets.empty() || sets.back()->valves != row.valves) sets.push_back(&row);
  for (const ScalingRow* set : sets) {
    files[set->valves] = data_of(rows, set->valves);
    script += column_text(fmt::format("{} states ({})", set->states, set->valves), set->valves, set == sets.front(),
                          set == sets.back(), set->deadlines);
  }
  draw_with_gnuplot(files, script + "unset multiplot\nset output\n", path);
}

}  // namespace solenoid
