#include "experiments/systems/actuator/identify/output.hpp"

#include "experiments/base/gnuplot.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Column = Table::Column;

const KnownTruth* truth_of(const std::vector<KnownTruth>& truths, const std::string& name) {
  const auto at = std::ranges::find(truths, name, &KnownTruth::name);
  return at == truths.end() ? nullptr : &*at;
}

}  // namespace

Result result_of(const Findings& found, const std::vector<KnownTruth>& truths) {
  using Data = Table::Data;
  Table table{.name = "estimates",
              .columns = {Column("name", "value", "<"), Column("value", "estimate", ".5g"),
                          Column("low", "95 % from", ".5g"), Column("high", "to", ".5g"), Column("", "+- %", ".2g%"),
                          Column("sigma"), Column("degrees_of_freedom"), Column("parameter"),
                          Column("truth?", truths.empty() ? "" : "truth", ".5g", Data::json),
                          Column("unit", "unit", "<"), Column("method", "from", "<", Data::json)}};
  for (const Estimate& e : found.estimates) {
    const KnownTruth* t = truth_of(truths, e.name);
    table.add({e.name,
               e.value,
               e.low,
               e.high,
               (e.high - e.low) / 2 / std::abs(e.value),
               e.sigma,
               e.freedom,
               e.parameter,
               {t ? Json(t->value) : Json(), t && e.contains(t->value)},
               e.unit,
               e.method});
  }
  if (!truths.empty()) table.notes = {"truth*: inside the interval"};
  table.notes.insert(table.notes.end(), found.remarks.begin(), found.remarks.end());
  return {.facts = {{"remarks", found.remarks}}, .tables = {table}};
}

std::string thesis_friction_text() {
  const Estimate s = static_friction_of_table_4_1();
  return fmt::format(
      "Table 4-1: F_sf = {:.3g} N, 95 % interval of its mean {:.3g} to {:.3g} N; one test to the next varies by {:.2g} "
      "N\n{}\n",
      s.value, s.low, s.high, s.sigma * std::sqrt(s.freedom + 1), judge_table_4_2().text);
}

Plot residuals(const ResidualPlot& plot) {
  std::string data;
  for (const ResidualPlot::Point& p : plot.points)
    data += fmt::format("{:.6g} {:.8g} {:.8g} {:.6g}\n", p.x, p.measured, p.modelled, p.measured - p.modelled);
  const char* measured = plot.lines ? "lines lw 1.2" : "points pt 7 ps 0.5";
  return {
      .width = 900,
      .height = 560,
      .title = plot.title,
      .layout = "2,1 margins screen 0.1, screen 0.97, screen 0.1, screen 0.92 spacing screen 0.05",
      .settings = "set offsets 0, 0, graph 0.05, graph 0.05\n",
      .panels = {{fmt::format("set format x ''\nset key right top\nset ylabel {}\n", gnuplot_quoted(plot.y_label)),
                  data,
                  {{fmt::format("using 1:2 with {} lc rgb '#1f77b4'", measured), "measured"},
                   {"using 1:3 with lines lw 1.2 lc rgb '#d62728'", "model"}}},
                 {fmt::format("unset key\nset format x '%g'\nset xlabel {}\nset ylabel {}\n",
                              gnuplot_quoted(plot.x_label), gnuplot_quoted("residual, " + plot.y_label)),
                  data,
                  {{"0 with lines lc rgb '#909090'"}, {fmt::format("using 1:4 with {} lc rgb '#2ca02c'", measured)}}}}};
}

}  // namespace solenoid
