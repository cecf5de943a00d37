#include "experiments/base/files.hpp"
#include "experiments/base/gnuplot.hpp"
#include "experiments/base/text_table.hpp"
#include "experiments/study/fishing.hpp"

#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

struct NamedFigure {
  const char* name;
  double FishingRow::*value;
};
constexpr NamedFigure figures[] = {{"relaxed", &FishingRow::relaxed},
                                   {"sum_up", &FishingRow::sum_up},
                                   {"approximated", &FishingRow::approximated},
                                   {"improved", &FishingRow::improved},
                                   {"sum_up_gap", &FishingRow::sum_up_gap},
                                   {"guarantee", &FishingRow::guarantee},
                                   {"approximated_gap", &FishingRow::approximated_gap},
                                   {"relaxing_ms", &FishingRow::relaxing_ms}};

}  // namespace

std::string fishing_text(const FishingStudy& study) {
  TextTable table({{"intervals"},
                   {"relaxed"},
                   {"sum-up rounding"},
                   {"excess"},
                   {"gap"},
                   {"allowed"},
                   {"switches"},
                   {"CIA"},
                   {"gap"},
                   {"improved"},
                   {"switches"},
                   {"relaxing ms"}});
  for (const FishingRow& r : study.rows)
    table.add_row(std::vector<std::string>{std::to_string(r.intervals), fmt::format("{:.6f}", r.relaxed),
                                           fmt::format("{:.6f}", r.sum_up), fmt::format("{:.6f}", r.sum_up - r.relaxed),
                                           fmt::format("{:.4f}", r.sum_up_gap), fmt::format("{:.4f}", r.guarantee),
                                           std::to_string(r.sum_up_switches), fmt::format("{:.6f}", r.approximated),
                                           fmt::format("{:.4f}", r.approximated_gap), fmt::format("{:.6f}", r.improved),
                                           std::to_string(r.improved_switches), fmt::format("{:.0f}", r.relaxing_ms)});
  std::string text =
      "Lotka-Volterra fishing, relaxed and rounded; published: relaxed " +
      fmt::format("{}, two switches {}.\n\n", fishing_published_relaxed, fishing_published_two_switches) +
      table.text(false);
  if (study.rows.size() > 1)
    text += fmt::format("\nSum-up rounding's excess over the finest relaxed optimum falls as length^{:.2f}.\n",
                        study.order);
  if (study.two.intervals > 0)
    text += fmt::format(
        "Two switches, {} intervals: {:.6f} by integral approximation (gap {:.4f}, proven >= {:.4f}), "
        "{:.6f} by mode swaps, {:.6f} on a finer model: fishing from {:.3f} to {:.3f}.\n",
        study.two.intervals, study.two.approximated, study.two.gap, study.two.gap_bound, study.two.improved,
        study.two.refined, study.two.from, study.two.to);
  return text;
}

std::string fishing_json(const FishingStudy& study) {
  nlohmann::ordered_json json = {{"published_relaxed", fishing_published_relaxed},
                                 {"published_two_switches", fishing_published_two_switches},
                                 {"order", study.order},
                                 {"rows", nlohmann::ordered_json::array()}};
  for (const FishingRow& r : study.rows) {
    nlohmann::ordered_json row = {{"intervals", r.intervals}};
    for (const NamedFigure& f : figures) row[f.name] = r.*f.value;
    row["sum_up_switches"] = r.sum_up_switches;
    row["improved_switches"] = r.improved_switches;
    row["iterations"] = r.iterations;
    json["rows"].push_back(row);
  }
  const FishingWithTwoSwitches& t = study.two;
  if (t.intervals > 0)
    json["two_switches"] = {{"intervals", t.intervals},
                            {"gap", t.gap},
                            {"gap_bound", t.gap_bound},
                            {"approximated", t.approximated},
                            {"improved", t.improved},
                            {"refined", t.refined},
                            {"from", t.from},
                            {"to", t.to},
                            {"milliseconds", t.milliseconds}};
  return json.dump(1) + "\n";
}

std::string fishing_csv(const FishingStudy& study) {
  std::string text = "intervals";
  for (const NamedFigure& f : figures) text += fmt::format(",{}", f.name);
  text += ",sum_up_switches,improved_switches\n";
  for (const FishingRow& r : study.rows) {
    text += std::to_string(r.intervals);
    for (const NamedFigure& f : figures) text += fmt::format(",{}", r.*f.value);
    text += fmt::format(",{},{}\n", r.sum_up_switches, r.improved_switches);
  }
  return text;
}

void draw_fishing(const FishingStudy& study, const std::string& path) {
  std::string data;
  const double optimum = study.rows.empty() ? 0.0 : study.rows.back().relaxed;
  for (const FishingRow& r : study.rows)
    data += fmt::format("{} {} {} {} {} {} {}\n", 12.0 / r.intervals, r.sum_up - optimum, r.improved - optimum,
                        r.sum_up_gap, r.guarantee, r.approximated_gap, r.relaxed);
  const std::string script = R"(set terminal svg size 1000,420 font 'Helvetica,13' background '#ffffff' noenhanced
set output 'figure'
set encoding utf8
set multiplot layout 1,2
set logscale xy
set grid back lt 1 lw 0.7 lc rgb '#dddddd'
set border 3 lc rgb '#606060'
set tics nomirror out scale 0.5
set format y '%g'
set key left top reverse Left samplen 1.5
set xlabel 'length of an interval'
set ylabel 'cost above the relaxed optimum'
plot 'data' using 1:2 with linespoints pt 7 ps 0.7 lw 1.8 lc rgb '#1f77b4' title 'sum-up rounding', \
     '' using 1:3 with linespoints pt 4 ps 0.8 lw 1.5 lc rgb '#ff7f0e' title 'improved', \
     0.02 * x / 0.125 with lines dt (6,4) lc rgb '#7f7f7f' title 'linear'
set ylabel 'integral gap'
plot 'data' using 1:5 with lines dt (6,4) lc rgb '#d62728' title 'allowed by the theory', \
     '' using 1:4 with linespoints pt 7 ps 0.7 lw 1.8 lc rgb '#1f77b4' title 'sum-up rounding', \
     '' using 1:6 with linespoints pt 4 ps 0.8 lw 1.5 lc rgb '#2ca02c' title 'integral approximation'
unset multiplot
set output
)";
  draw_with_gnuplot({{"data", data}}, script, path);
}

}  // namespace solenoid
