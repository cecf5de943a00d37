#include "experiments/report/run_figure.hpp"

#include "controllers/systems.hpp"
#include "experiments/base/gnuplot.hpp"
#include "experiments/base/table.hpp"
#include "experiments/report/headings.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr int figure_spans = 500, panel_height = 160;  // pixels
constexpr double room_above = 52, room_below = 52, room_between = 14.4;
constexpr std::size_t most_mode_names = 12;  // of a panel: more of them would lie over each other

/// How people read the times of a run: a brief one in milliseconds.
struct TimeUnit {
  const char* name = "s";
  double scale = 1.0;
};

TimeUnit time_unit(double duration_s) { return duration_s < 0.101 ? TimeUnit{"ms", 1e3} : TimeUnit{}; }

/// Of panels that share a place the first.
std::vector<TraceLayout::Panel> shown_panels(const Trace& trace) {
  std::vector<TraceLayout::Panel> shown;
  std::set<std::string> places;
  for (const TraceLayout::Panel& panel : trace.panels)
    if (panel.choice.empty() || places.insert(panel.choice).second) shown.push_back(panel);
  return shown;
}

std::string panel_label(const TraceLayout::Panel& panel) {
  return panel.unit.empty() ? panel.label : fmt::format("{} [{}]", panel.label, panel.unit);
}

/// A name as a tic's label, which gnuplot takes for a format.
std::string tic_label(const std::string& name) {
  std::string format;
  for (const char c : name) format += c == '%' ? std::string("%%") : std::string(1, c);
  return gnuplot_quoted(format);
}

/// Draws one run.
class RunFigure {
 public:
  RunFigure(const Trace& trace, const std::string& title, double font)
      : trace_(trace),
        thinned_(overview(trace, figure_spans)),
        panels_(shown_panels(trace)),
        title_(title),
        font_(font),
        end_s_(trace.tick_s * static_cast<double>(trace.ticks.empty() ? 1 : trace.ticks.back() + 1)),
        time_(time_unit(end_s_)) {}

  Plot plot() {
    const auto count = static_cast<int>(panels_.size());
    const double height = panel_height * count;
    Plot plot{.width = 1280,
              .height = panel_height * count,
              .title = title_,
              .layout = fmt::format("{},1 margins screen 0.075, screen 0.865, screen {:.4g}, screen {:.4g} spacing "
                                    "screen {:.4g}",
                                    count, room_below / height, 1 - room_above / height, room_between / height),
              .settings = fmt::format("set xrange [0:{:.9g}]\nset format x ''\nset format y '%5.4g'\n"
                                      "set offsets 0, 0, graph 0.05, graph 0.05\n",
                                      time_.scale * end_s_)};
    for (const TraceLayout::Panel& panel : panels_) plot.panels.push_back(panel.modes ? modes(panel) : values(panel));
    if (!plot.panels.empty())
      plot.panels.back().settings +=
          fmt::format("set format x '%g'\nset xlabel 'time [{}]' offset 0,0.4\n", time_.name);
    return plot;
  }

 private:
  std::string line(const Trace& trace, std::size_t i, double value) const {
    return fmt::format("{:.9g} {:.5g}\n", time_.scale * trace.tick_s * static_cast<double>(trace.ticks[i]), value);
  }

  /// Lines `time value`; what is no number is a gap.
  std::string lines_of(const TraceLayout::Panel& panel, const std::string& signal) const {
    std::string text;
    const std::vector<double>& values = thinned_.signal(signal).values;
    for (std::size_t i = 0; i < values.size(); ++i) text += line(thinned_, i, panel.scale * values[i]);
    return text;
  }

  /// Lines `time mode` where the mode changes.
  std::string steps_of(const std::string& signal) const {
    std::string text;
    const std::vector<double>& values = trace_.signal(signal).values;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (i == 0 || i + 1 == values.size() || values[i] != values[i - 1]) text += line(trace_, i, values[i]);
    return text;
  }

  /// Distance of the tics that divides the range of a panel's curves, zero in it, into three to eight: 1, 2 or 5 times
  /// a power of 10.
  double tic_distance(const TraceLayout::Panel& panel) const {
    double low = -panel.limit, high = panel.limit;
    for (const TraceLayout::Curve& curve : panel.curves)
      for (const double value : thinned_.signal(curve.signal).values) {
        if (!std::isfinite(value)) continue;
        low = std::min(low, panel.scale * value);
        high = std::max(high, panel.scale * value);
      }
    if (!(high - low > 1e-9) || !std::isfinite(high - low)) return 1.0;
    const double least = (high - low) / 7, power = std::pow(10.0, std::floor(std::log10(least)));
    for (const double digit : {1.0, 2.0, 5.0})
      if (digit * power >= least) return digit * power;
    return 10.0 * power;
  }

  /// At least the panel's limit to either side, and what its curves reach.
  double symmetric_range(const TraceLayout::Panel& panel) const {
    double most = panel.limit;
    for (const TraceLayout::Curve& curve : panel.curves)
      for (const double value : thinned_.signal(curve.signal).values)
        if (std::isfinite(value)) most = std::max(most, panel.scale * std::abs(value));
    return 1.1 * most;
  }

  /// The panel's name and unit beside it: smaller if it must be, then cut, but for the unit.
  std::string axis_label(TraceLayout::Panel panel) const {
    constexpr double a_character = 0.55, least = 0.7;  // of the font's size
    const auto fitting = [&](double size) {
      return static_cast<std::size_t>(0.9 * panel_height / (a_character * size));
    };
    const std::size_t length = panel_label(panel).size(), most = fitting(least * font_);
    const double size = font_ * (length <= fitting(font_) ? 1.0 : least);
    if (length > most) {
      std::size_t kept = panel.label.size() - std::min(panel.label.size(), length + 3 - most);
      while (kept > 0 && (static_cast<unsigned char>(panel.label[kept]) & 0xc0u) == 0x80u) --kept;  // inside a letter
      panel.label = panel.label.substr(0, kept) + "...";
    }
    return fmt::format("set ylabel {} font ',{:g}'\n", gnuplot_quoted(panel_label(panel)), size);
  }

  /// Where several curves need names, they stand beside the panel.
  std::string key_of(const TraceLayout::Panel& panel) const {
    if (panel.curves.size() < 2) return "unset key\n";
    const bool is_long = std::ranges::any_of(panel.curves, [](const auto& curve) { return curve.label.size() > 9; });
    return fmt::format("set key at screen 0.995, graph 0.98 right vertical{}\n",
                       is_long ? fmt::format(" samplen 1.5 font ',{:g}'", 0.7 * font_) : "");
  }

  Plot::Panel values(const TraceLayout::Panel& panel) {
    Plot::Panel drawn{key_of(panel) + "unset y2tics\n" + axis_label(panel), "", {}};
    if (panel.limit > 0) {
      const double most = symmetric_range(panel);
      drawn.settings += fmt::format("set yrange [{:.6g}:{:.6g}]\n", -most, most);
    } else {
      drawn.settings += "set yrange [*:*]\n";
    }
    drawn.settings += fmt::format("set ytics {:g}\n", tic_distance(panel));
    if (panel.zero) drawn.curves.push_back({"0 with lines lc rgb '#909090'"});
    const auto desired = std::ranges::count(panel.curves, true, &TraceLayout::Curve::desired);
    const double width = desired > 0 ? 2.0 : 1.2;
    std::string colour = "#000000";
    for (std::size_t i = 0; i < panel.curves.size(); ++i) {
      const TraceLayout::Curve& curve = panel.curves[i];
      drawn.data += (i > 0 ? "\n\n" : "") + lines_of(panel, curve.signal);
      if (!curve.desired) colour = next_colour();
      // One desired motion is black; several are told apart by the colours of what follows them.
      drawn.curves.push_back({curve.desired
                                  ? fmt::format("index {} using 1:2 with lines lw 1.2 dt (8,6) lc rgb '{}'", i,
                                                desired > 1 ? colour : "#000000")
                                  : fmt::format("index {} using 1:2 with lines lw {:g} lc rgb '{}'", i, width, colour),
                              panel.curves.size() > 1 ? curve.label : ""});
    }
    return drawn;
  }

  std::string mode_tics(std::size_t every) const {
    std::string tics;
    for (std::size_t m = 0; m < trace_.modes.size(); m += every)
      tics += fmt::format("{}{} {}", m ? ", " : "", tic_label(trace_.modes[m]), m);
    return tics;
  }

  Plot::Panel modes(const TraceLayout::Panel& panel) {
    const std::size_t count = trace_.modes.size(), every = (count + most_mode_names - 1) / most_mode_names;
    const std::string text = fmt::format(
        "unset key\n{0}set yrange [-0.4:{1}]\nset ytics {2}\n"
        "set y2range [-0.4:{1}]\nset y2tics ({3}) scale 0 font ',{4}'\n",
        axis_label(panel), static_cast<double>(count) - 1 + 0.4, every, mode_tics(std::max<std::size_t>(every, 1)),
        font_ * (count > 4 ? 0.65 : 0.8));
    return {text,
            steps_of(panel.curves.front().signal),
            {{fmt::format("using 1:2 with steps lw 0.8 lc rgb '{}'", next_colour())}}};
  }

  std::string next_colour() {
    constexpr const char* colours[] = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd",
                                       "#ff7f0e", "#8c564b", "#e377c2", "#17becf"};
    return colours[colour_++ % std::size(colours)];
  }

  const Trace& trace_;
  Trace thinned_;
  std::vector<TraceLayout::Panel> panels_;
  std::string title_;
  double font_, end_s_;
  TimeUnit time_;
  std::size_t colour_ = 0;
};

}  // namespace

std::string figure_title(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                         const Metrics& metrics) {
  const SystemDescription& system = system_of(variant).description();
  std::string title = fmt::format("{}   |   {}", variant.name, scenario.name);
  if (scenario.noise) title += fmt::format(", seed {}", seed);
  std::vector<MetricColumn> told = {judged_metric(system)};
  for (const MetricColumn& metric : system.metrics)
    if (!metric.heading.empty() && metric.detail && metric.best_least && !metric.effort && !metric.whole &&
        metric.key != system.judged.metric)
      told.push_back(metric);
  const char* before = "   |   ";
  for (const MetricColumn& metric : told) {
    if (!metrics.has(metric.key)) continue;
    const MetricHeading heading = metric_heading(metric);
    title += fmt::format("{}{} {}{}{}", before, heading.label, short_number(metrics.number(metric.key)),
                         heading.unit.empty() ? "" : " ", heading.unit);
    before = ", ";
  }
  return title;
}

void draw_figure(const Trace& trace, const std::string& title, const std::string& path, FigureFormat format) {
  draw(RunFigure(trace, title, format == FigureFormat::svg ? 13 : 10).plot(), path, format);
}

void draw_figure(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                 const RunResult& result, const std::string& path, FigureFormat format) {
  draw_figure(make_trace(variant, scenario, result.ticks), figure_title(variant, scenario, seed, result.metrics), path,
              format);
}

void draw_figure(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                 const std::string& path, FigureFormat format) {
  draw_figure(variant, scenario, seed, simulate(variant, scenario, seed), path, format);
}

}  // namespace solenoid
