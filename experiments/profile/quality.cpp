#include "experiments/profile/quality.hpp"

#include "experiments/base/gnuplot.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/profile/replay.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double late_us = 50.0;

/// Sums over a variant's runs at one budget.
struct Sums {
  double log_rmse = 0, proven = 0;
  int runs = 0, unstable = 0;
  std::int64_t solves = 0, late = 0;

  void add(const RunResult& run, double budget_ms) {
    proven += run.metrics.proven_optimal_fraction;
    ++runs;
    unstable += !run.metrics.finite;
    if (run.metrics.finite) log_rmse += std::log(std::max(run.metrics.rmse_mm, 1e-9));
    for (const TickRecord& t : run.ticks) {
      solves += t.decision.solved;
      late += t.decision.solved && t.decision.report.time_us > 1e3 * budget_ms + late_us;
    }
  }
  QualityPoint point(const std::string& variant, double budget_ms) const {
    const int finite = runs - unstable;
    return {variant,
            budget_ms,
            finite > 0 ? std::exp(log_rmse / finite) : 0.0,
            proven / std::max(runs, 1),
            static_cast<double>(late) / static_cast<double>(std::max<std::int64_t>(solves, 1)),
            unstable};
  }
};

std::string script_of(const std::vector<std::string>& variants, FigureFormat format) {
  const char* terminal = format == FigureFormat::svg ? "svg size 1000,720 font 'Helvetica,13' background rgb 'white'"
                                                     : "pngcairo size 1000,720 font 'Helvetica,10'";
  std::string rmse, proven;
  for (std::size_t i = 0; i < variants.size(); ++i) {
    const char* separator = i == 0 ? "plot " : ", \\\n  ";
    rmse += fmt::format("{}'curve{}' using 1:2 with linespoints lw 1.5 pt {} title {}", separator, i, i % 12 + 4,
                        gnuplot_quoted(variants[i]));
    proven += fmt::format("{}'curve{}' using 1:3 with linespoints lw 1.5 pt {} notitle", separator, i, i % 12 + 4);
  }
  return fmt::format(R"(set terminal {}
set output 'figure'
set multiplot layout 2,1
set logscale x
set grid
set lmargin 11
set rmargin 24
set key outside right top noenhanced
set title 'quality against time: closed loops with every solve cut at a budget'
set ylabel 'RMSE [mm], geometric mean'
set logscale y
{}
set title ''
set xlabel 'budget of a solve [ms]'
set ylabel 'proven optimal [%]'
unset logscale y
set yrange [0:105]
{}
unset multiplot
set output
)",
                     terminal, rmse, proven);
}

}  // namespace

std::vector<QualityPoint> quality_against_time(const Campaign& campaign, const std::vector<double>& budgets_ms,
                                               int core, const std::function<bool()>& interrupted) {
  const PinnedCore pinned(core);
  std::vector<QualityPoint> points;
  for (VariantConfig variant : campaign.variants)
    for (const double budget_ms : budgets_ms) {
      variant.deadline_ms = budget_ms;
      Sums sums;
      for (const ScenarioConfig& scenario : campaign.scenarios)
        for (const std::uint64_t seed : campaign.seeds) {
          if (interrupted()) return points;
          sums.add(simulate(variant, scenario, seed), budget_ms);
        }
      points.push_back(sums.point(variant.name, budget_ms));
    }
  return points;
}

void draw_quality(const std::vector<QualityPoint>& points, const std::string& path, FigureFormat format) {
  std::vector<std::string> variants, data;
  for (const QualityPoint& p : points) {
    if (variants.empty() || variants.back() != p.variant) {
      variants.push_back(p.variant);
      data.emplace_back();
    }
    data.back() += fmt::format("{} {} {}\n", p.budget_ms, p.rmse_mm > 0 ? fmt::format("{}", p.rmse_mm) : "NaN",
                               100 * p.proven_fraction);
  }
  std::map<std::string, std::string> files;
  for (std::size_t i = 0; i < data.size(); ++i) files[fmt::format("curve{}", i)] = data[i];
  draw_with_gnuplot(files, script_of(variants, format), path);
}

}  // namespace solenoid
