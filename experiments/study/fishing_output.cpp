#include "experiments/base/result.hpp"
#include "experiments/study/fishing.hpp"

#include <fmt/format.h>

namespace solenoid {
namespace {

using Column = Table::Column;

Table grids(const FishingStudy& study) {
  Table table{.name = "rows",
              .columns = {Column("intervals", "intervals"), Column("relaxed", "relaxed", ".6f"),
                          Column("sum_up", "sum-up rounding", ".6f"), Column("", "excess", ".6f"),
                          Column("approximated", "CIA", ".6f"), Column("improved", "improved", ".6f"),
                          Column("sum_up_gap", "gap of sum-up", ".4f"), Column("guarantee", "allowed", ".4f"),
                          Column("approximated_gap", "gap of CIA", ".4f"), Column("relaxing_ms", "relaxing ms", ".0f"),
                          Column("sum_up_switches", "switches of sum-up"), Column("improved_switches", "of improved"),
                          Column("iterations", "", "", Table::Data::json)}};
  for (const FishingRow& r : study.rows)
    table.add({r.intervals, r.relaxed, r.sum_up, r.sum_up - r.relaxed, r.approximated, r.improved, r.sum_up_gap,
               r.guarantee, r.approximated_gap, r.relaxing_ms, r.sum_up_switches, r.improved_switches, r.iterations});
  return table;
}

/// Costs and gaps against the length of an interval.
Plot plot_of(const FishingStudy& study) {
  std::string data;
  const double optimum = study.rows.empty() ? 0.0 : study.rows.back().relaxed;
  for (const FishingRow& r : study.rows)
    data += fmt::format("{} {} {} {} {} {} {}\n", 12.0 / r.intervals, r.sum_up - optimum, r.improved - optimum,
                        r.sum_up_gap, r.guarantee, r.approximated_gap, r.relaxed);
  const auto blue = "with linespoints pt 7 ps 0.7 lw 1.8 lc rgb '#1f77b4'";
  return {.layout = "1,2",
          .settings =
              "set logscale xy\nset format y '%g'\nset key left top reverse Left samplen 1.5\n"
              "set xlabel 'length of an interval'\n",
          .panels = {{"set ylabel 'cost above the relaxed optimum'\n",
                      data,
                      {{fmt::format("using 1:2 {}", blue), "sum-up rounding"},
                       {"using 1:3 with linespoints pt 4 ps 0.8 lw 1.5 lc rgb '#ff7f0e'", "improved"},
                       {"0.02 * x / 0.125 with lines dt (6,4) lc rgb '#7f7f7f'", "linear"}}},
                     {"set ylabel 'integral gap'\n",
                      data,
                      {{"using 1:5 with lines dt (6,4) lc rgb '#d62728'", "allowed by the theory"},
                       {fmt::format("using 1:4 {}", blue), "sum-up rounding"},
                       {"using 1:6 with linespoints pt 4 ps 0.8 lw 1.5 lc rgb '#2ca02c'", "integral approximation"}}}}};
}

}  // namespace

Result result_of(const FishingStudy& study) {
  Result result{
      .title = fmt::format("Lotka-Volterra fishing, relaxed and rounded; published: relaxed {}, two switches {}.",
                           fishing_published_relaxed, fishing_published_two_switches),
      .facts = {{"published_relaxed", fishing_published_relaxed},
                {"published_two_switches", fishing_published_two_switches},
                {"order", study.order}},
      .tables = {grids(study)},
      .plot = plot_of(study)};
  if (study.rows.size() > 1)
    result.notes.push_back(
        fmt::format("Sum-up rounding's excess over the finest relaxed optimum falls as length^{:.2f}.", study.order));
  const FishingWithTwoSwitches& t = study.two;
  if (t.intervals == 0) return result;
  result.notes.push_back(
      fmt::format("Two switches, {} intervals: {:.6f} by integral approximation (gap {:.4f}, proven >= {:.4f}), "
                  "{:.6f} by mode swaps, {:.6f} on a finer model: fishing from {:.3f} to {:.3f}.",
                  t.intervals, t.approximated, t.gap, t.gap_bound, t.improved, t.refined, t.from, t.to));
  result.facts["two_switches"] = {{"intervals", t.intervals},
                                  {"gap", t.gap},
                                  {"gap_bound", t.gap_bound},
                                  {"approximated", t.approximated},
                                  {"improved", t.improved},
                                  {"refined", t.refined},
                                  {"from", t.from},
                                  {"to", t.to},
                                  {"milliseconds", t.milliseconds}};
  return result;
}

}  // namespace solenoid
