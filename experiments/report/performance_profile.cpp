#include "experiments/report/performance_profile.hpp"

#include "core/config/reader.hpp"
#include "experiments/report/headings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// Lines `tau share`, from share 0 at tau 1 to the end of the axis.
std::string curve_text(const PerformanceProfile& profile, double most) {
  std::string text = "1 0\n";
  const auto runs = static_cast<double>(profile.runs), ok = static_cast<double>(profile.ok);
  const std::size_t points = profile.ratios.size(),
                    first = points < profile.ok ? 0 : 1;  // quantiles begin at the least
  for (std::size_t i = 0; i < points; ++i)
    text += fmt::format("{} {}\n", profile.ratios[i],
                        static_cast<double>(i + first) / static_cast<double>(points - 1 + first) * ok / runs);
  return text + fmt::format("{} {}\n", most, ok / runs);
}

}  // namespace

std::vector<PerformanceProfile> performance_profiles(const TaskErrors& errors, std::size_t most) {
  std::vector<PerformanceProfile> profiles(errors.variants());
  for (std::size_t task = 0; task < errors.tasks(); ++task) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t v = 0; v < errors.variants(); ++v)
      if (errors.ok(task, v)) least = std::min(least, errors.error(task, v));
    for (std::size_t v = 0; v < errors.variants(); ++v) {
      ++profiles[v].runs;
      if (errors.ok(task, v)) profiles[v].ratios.push_back(errors.error(task, v) / least);
    }
  }
  for (PerformanceProfile& profile : profiles) {
    profile.ok = profile.ratios.size();
    profile.ratios = quantiles(std::move(profile.ratios), most);
  }
  return profiles;
}

void draw_profiles(const RunTable& runs, const std::string& path, FigureFormat format) {
  const Ranking ranking = rank_variants(runs);
  const std::vector<PerformanceProfile> profiles = performance_profiles(TaskErrors(runs), 1001);
  double most = 1.0;
  for (const PerformanceProfile& profile : profiles)
    if (!profile.ratios.empty()) most = std::max(most, profile.ratios.back());
  if (std::ranges::all_of(profiles, [](const PerformanceProfile& p) { return p.ok == 0; }))
    throw ConfigError("no run ended well, nothing to draw");
  const MetricHeading judged = metric_heading(judged_metric(runs.system()));
  // At least half an octave, so that there is an axis where all are alike; of three, powers of two are too few ticks.
  const double end = std::max(std::sqrt(2.0), 1.02 * most);
  Plot plot{.width = 900,
            .height = 560,
            .title = fmt::format("Share of {} tasks where the {} is at most tau times the least of all variants",
                                 profiles.front().runs, judged.label),
            .settings = fmt::format("set logscale x 2\nset xrange [1:{}]\nset yrange [0:1.02]\nset xlabel 'tau, log2 "
                                    "scale'\nset ylabel 'share of tasks'\nset key outside right top Left reverse\n{}",
                                    end, end < 8 ? "set xtics (1,1.1,1.25,1.5,2,3,4,6)\n" : "")};
  Plot::Panel& panel = plot.panels.emplace_back();
  for (const RankedVariant& v : ranking.variants) {
    const auto number = std::ranges::find(runs.variants(), v.variant) - runs.variants().begin();
    const std::size_t place = panel.curves.size();
    panel.data += curve_text(profiles[static_cast<std::size_t>(number)], end) + "\n\n";
    panel.curves.push_back({fmt::format("index {} using 1:2 with steps lw 1.6 dt {} lc rgb '{}'", place, 1 + place / 8,
                                        plot_colour(place)),
                            v.variant});
  }
  draw(plot, path, format);
}

}  // namespace solenoid
