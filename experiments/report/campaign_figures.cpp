#include "experiments/report/campaign_figures.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/gnuplot.hpp"
#include "experiments/report/pareto.hpp"
#include "experiments/report/performance_profile.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

void draw_run(Results& results, const StoredRun& run, const std::string& path, FigureFormat format) {
  const VariantConfig* variant = results.variant(run.record.variant);
  const std::optional<ScenarioConfig> scenario = results.scenario(run.record.scenario);
  const std::optional<Trace> trace = read_trace(results, run);
  if (!trace || trace->ticks.empty() || trace->panels.empty() || !variant || !scenario)
    throw ConfigError(
        fmt::format("{}: run {} has no curves to draw (allowed: a run with a trace or a log)", results.folder, run.id));
  draw_figure(*trace, figure_title(*variant, *scenario, run.record.seed, run.record.metrics.value_or(Metrics{})), path,
              format);
}

/// Histograms by variant, in the campaign's order.
std::vector<std::pair<std::string, SolveHistogram>> solve_times(Results& results) {
  for (StoredRun& run : results.runs)
    if (run.solves.counts.empty())
      if (const auto trace = read_trace(results, run)) run.solves = trace->solves;
  const std::shared_ptr<const RunTable> table = results.table();
  std::vector<std::pair<std::string, SolveHistogram>> list;
  for (const VariantConfig& variant : results.campaign.variants) {
    const auto found = std::ranges::find(table->variants(), variant.name);
    const auto number = static_cast<std::uint32_t>(found - table->variants().begin());
    if (SolveHistogram times = table->solves(number).times; times.total() > 0)
      list.emplace_back(variant.name, std::move(times));
  }
  return list;
}

/// Lines `low high count`.
std::string bins_text(const SolveHistogram& histogram) {
  std::string text;
  for (std::size_t i = 0; i < histogram.counts.size(); ++i) {
    const auto edge = [&](std::size_t bin) {
      return std::pow(10.0, (histogram.first + static_cast<double>(bin)) / SolveHistogram::per_decade);
    };
    if (histogram.counts[i] > 0) text += fmt::format("{} {} {}\n", edge(i), edge(i + 1), histogram.counts[i]);
  }
  return text;
}

Plot solve_time_plot(const std::vector<std::pair<std::string, SolveHistogram>>& variants, double period_s) {
  const int count = static_cast<int>(variants.size()), columns = std::min(3, count),
            lines = (count + columns - 1) / columns;
  // The line of the period is always inside, with a little beyond it.
  const double period_us = 1e6 * period_s, bin = SolveHistogram::per_decade * std::log10(period_us);
  int first = static_cast<int>(std::floor(bin)), end = static_cast<int>(std::ceil(bin)) + 3;
  std::int64_t most = 10;
  for (const auto& [name, histogram] : variants) {
    first = std::min(first, histogram.first);
    end = std::max(end, histogram.first + static_cast<int>(histogram.counts.size()));
    most = std::max(most, *std::ranges::max_element(histogram.counts));
  }
  Plot plot{.width = 420 * columns,
            .height = 260 * lines,
            .layout = fmt::format("{},{}", lines, columns),
            .settings = fmt::format(
                "set logscale xy\nset xrange [{0}:{1}]\nset yrange [0.7:{2}]\nset format x '%g'\n"
                "set xlabel 'time of a solve [µs]'\nset ylabel 'solves'\nunset mxtics\nunset mytics\nunset key\n"
                "set arrow 1 from {3},graph 0 to {3},graph 1 nohead lw 1.5 lc rgb '#d62728'\n"
                "set label 1 '{4}' at {3},graph 0.95 left offset 0.4,0 tc rgb '#d62728'\n",
                std::pow(10.0, std::floor(first / 10.0)), std::pow(10.0, end / 10.0), 2 * most, period_us,
                period_us < 1e3 ? fmt::format("{:g} µs", period_us) : fmt::format("{:g} ms", 1e-3 * period_us))};
  for (const auto& [name, histogram] : variants)
    plot.panels.push_back(
        {fmt::format("set title {}\n", gnuplot_quoted(name)),
         bins_text(histogram),
         {{"using (sqrt($1*$2)):3:1:2:(0.7):3 with boxxyerror fs solid 0.8 noborder lc rgb '#1f77b4'"}}});
  return plot;
}

void draw_solve_time(Results& results, const std::string& path, FigureFormat format) {
  const auto variants = solve_times(results);
  if (variants.empty())
    throw ConfigError(results.folder + ": no run with recorded solver times (allowed: runs with a trace or a log)");
  draw(solve_time_plot(variants, period_of(results.campaign)), path, format);
}

}  // namespace

void draw_report_figure(Results& results, const std::string& figure, const std::string& path, FigureFormat format) {
  if (figure == "profile") return draw_profiles(*results.table(), path, format);
  if (figure == "solve_time") return draw_solve_time(results, path, format);
  if (figure != "pareto") return draw_run(results, results.run(figure), path, format);
  const char* ending = format == FigureFormat::svg ? ".svg" : ".png";
  if (!path.ends_with(ending)) throw ConfigError(fmt::format("{}: not a figure's name (allowed: *{})", path, ending));
  draw_ranked(rank_variants(*results.table()), path);
}

}  // namespace solenoid
