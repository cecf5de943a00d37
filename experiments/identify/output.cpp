#include "experiments/identify/output.hpp"

#include "experiments/base/gnuplot.hpp"
#include "experiments/base/text_table.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

const KnownTruth* truth_of(const std::vector<KnownTruth>& truths, const std::string& name) {
  const auto at = std::ranges::find(truths, name, &KnownTruth::name);
  return at == truths.end() ? nullptr : &*at;
}

}  // namespace

std::string identification_text(const Findings& found, const std::vector<KnownTruth>& truths, bool colour) {
  std::vector<TextTable::Column> columns = {
      {"value", TextTable::Align::left}, {"estimate"}, {"95 % from"}, {"to"}, {"+- %"}};
  if (!truths.empty()) columns.push_back({"truth"});
  columns.push_back({"unit", TextTable::Align::left});
  columns.push_back({"from", TextTable::Align::left});
  TextTable table(columns);
  for (const Estimate& e : found.estimates) {
    std::vector<TextTable::Cell> row = {{e.name},
                                        {fmt::format("{:.5g}", e.value)},
                                        {fmt::format("{:.5g}", e.low)},
                                        {fmt::format("{:.5g}", e.high)},
                                        {fmt::format("{:.2g}", 50 * (e.high - e.low) / std::abs(e.value))}};
    if (!truths.empty()) {
      const KnownTruth* t = truth_of(truths, e.name);
      row.push_back({t ? fmt::format("{:.5g}", t->value) : "", t && e.contains(t->value)});
    }
    row.push_back({e.unit});
    row.push_back({e.method});
    table.add_row(std::move(row));
  }
  std::string text = table.text(colour);
  if (!truths.empty()) text += "truth*: inside the interval\n";
  for (const std::string& remark : found.remarks) text += remark + "\n";
  return text;
}

std::string identification_json(const Findings& found, const std::vector<KnownTruth>& truths) {
  nlohmann::ordered_json json = {{"estimates", nlohmann::ordered_json::array()}, {"remarks", found.remarks}};
  for (const Estimate& e : found.estimates) {
    nlohmann::ordered_json one = {{"name", e.name},           {"value", e.value}, {"low", e.low},
                                  {"high", e.high},           {"sigma", e.sigma}, {"degrees_of_freedom", e.freedom},
                                  {"parameter", e.parameter}, {"unit", e.unit},   {"method", e.method}};
    if (const KnownTruth* t = truth_of(truths, e.name)) one["truth"] = t->value;
    json["estimates"].push_back(std::move(one));
  }
  return json.dump(1) + "\n";
}

std::string identification_csv(const Findings& found) {
  std::string text = "name,value,low,high,sigma,degrees_of_freedom,parameter,unit\n";
  for (const Estimate& e : found.estimates)
    text += fmt::format("{},{},{},{},{},{},{},{}\n", e.name, e.value, e.low, e.high, e.sigma, e.freedom,
                        e.parameter ? 1 : 0, e.unit);
  return text;
}

std::string thesis_friction_text() {
  const Estimate s = static_friction_of_table_4_1();
  return fmt::format(
      "Table 4-1: F_sf = {:.3g} N, 95 % interval of its mean {:.3g} to {:.3g} N; one test to the next varies by {:.2g} "
      "N\n{}\n",
      s.value, s.low, s.high, s.sigma * std::sqrt(s.freedom + 1), judge_table_4_2().text);
}

void draw_residuals(const ResidualPlot& plot, const std::string& path) {
  std::string data;
  for (const ResidualPlot::Point& p : plot.points)
    data += fmt::format("{:.6g} {:.8g} {:.8g} {:.6g}\n", p.x, p.measured, p.modelled, p.measured - p.modelled);
  const char* measured = plot.lines ? "lines lw 1.2" : "points pt 7 ps 0.5";
  const std::string script = fmt::format(
      R"(set terminal svg size 900,560 font 'Helvetica,13' background '#ffffff' noenhanced
set output 'figure'
set encoding utf8
set multiplot layout 2,1 title {title} margins screen 0.1, screen 0.97, screen 0.1, screen 0.92 spacing screen 0.05
set border 3 lc rgb '#606060'
set grid back lt 1 lw 0.7 lc rgb '#dddddd'
set tics nomirror out scale 0.5
set format x ''
set key right top
set offsets 0, 0, graph 0.05, graph 0.05
set ylabel {y}
plot 'data' using 1:2 with {measured} lc rgb '#1f77b4' title 'measured', 'data' using 1:3 with lines lw 1.2 lc rgb '#d62728' title 'model'
unset key
set format x '%g'
set xlabel {x}
set ylabel {residual}
plot 0 with lines lc rgb '#909090', 'data' using 1:4 with {measured} lc rgb '#2ca02c'
unset multiplot
set output
)",
      fmt::arg("title", gnuplot_quoted(plot.title)), fmt::arg("x", gnuplot_quoted(plot.x_label)),
      fmt::arg("y", gnuplot_quoted(plot.y_label)), fmt::arg("residual", gnuplot_quoted("residual, " + plot.y_label)),
      fmt::arg("measured", measured));
  draw_with_gnuplot({{"data", data}}, script, path);
}

}  // namespace solenoid
