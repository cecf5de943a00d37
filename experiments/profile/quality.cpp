#include "experiments/profile/quality.hpp"

#include "experiments/campaign/simulate.hpp"
#include "experiments/profile/replay.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double late_us = 50.0;

/// Sums over a variant's runs at one budget.
struct Sums {
  double log_error = 0, proven = 0;
  int runs = 0, unstable = 0;
  std::int64_t solves = 0, late = 0;

  void add(const RunResult& run, const std::string& judged, double budget_ms) {
    proven += run.metrics.proven_optimal_fraction;
    ++runs;
    unstable += !run.metrics.finite;
    if (run.metrics.finite) log_error += std::log(std::max(run.metrics[judged], 1e-9));
    for (const TickRecord& t : run.ticks) {
      solves += t.decision.solved;
      late += t.decision.solved && t.decision.report.time_us > 1e3 * budget_ms + late_us;
    }
  }
  QualityPoint point(const std::string& variant, double budget_ms) const {
    const int finite = runs - unstable;
    return {variant,
            budget_ms,
            finite > 0 ? std::exp(log_error / finite) : 0.0,
            proven / std::max(runs, 1),
            static_cast<double>(late) / static_cast<double>(std::max<std::int64_t>(solves, 1)),
            unstable};
  }
};

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
          sums.add(simulate(variant, scenario, seed), campaign.system->description().judged.metric, budget_ms);
        }
      points.push_back(sums.point(variant.name, budget_ms));
    }
  return points;
}

Plot quality_plot(const std::vector<QualityPoint>& points, const std::string& error_heading) {
  Plot plot{.width = 1000,
            .height = 720,
            .title = "quality against time: closed loops with every solve cut at a budget",
            .layout = "2,1",
            .settings = "set logscale x\nset lmargin 11\nset rmargin 24\nset key outside right top\n",
            .panels = {{fmt::format("set ylabel '{}, geometric mean'\nset logscale y\n", error_heading), "", {}},
                       {"set xlabel 'budget of a solve [ms]'\nset ylabel 'proven optimal [%]'\nunset logscale y\n"
                        "set yrange [0:105]\n",
                        "",
                        {}}}};
  std::vector<std::string> variants;
  std::string data;
  for (const QualityPoint& q : points) {
    if (variants.empty() || variants.back() != q.variant) {
      const std::size_t i = variants.size();
      for (const int column : {2, 3})
        plot.panels[column == 2 ? 0 : 1].curves.push_back(
            {fmt::format("index {} using 1:{} with linespoints lw 1.5 pt {}", i, column, i % 12 + 4),
             column == 2 ? q.variant : ""});
      if (i > 0) data += "\n\n";
      variants.push_back(q.variant);
    }
    data += fmt::format("{} {} {}\n", q.budget_ms, q.error > 0 ? fmt::format("{}", q.error) : "NaN",
                        100 * q.proven_fraction);
  }
  for (Plot::Panel& panel : plot.panels) panel.data = data;
  return plot;
}

}  // namespace solenoid
