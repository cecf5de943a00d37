#include "experiments/report/run_figure.hpp"

#include "core/systems/actuator/valves.hpp"
#include "experiments/base/gnuplot.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::size_t spans = 500;

using Signal = std::function<double(const TickRecord&)>;

/// Lines `time value`: of each span of time its lowest and highest value, in their order.
std::string thinned(const std::vector<TickRecord>& ticks, const Signal& signal) {
  std::string text;
  const auto line = [&](const TickRecord& t) { text += fmt::format("{:.3f} {:.5g}\n", t.sensors.time_s, signal(t)); };
  const std::size_t n = ticks.size(), count = std::min(n, spans);
  for (std::size_t i = 0; i < count; ++i) {
    const auto first = ticks.begin() + static_cast<std::ptrdiff_t>(i * n / count);
    const auto last = ticks.begin() + static_cast<std::ptrdiff_t>((i + 1) * n / count);
    const auto [low, high] = std::minmax_element(
        first, last, [&](const TickRecord& a, const TickRecord& b) { return signal(a) < signal(b); });
    line(*std::min(low, high));
    if (low != high) line(*std::max(low, high));
  }
  if (!ticks.empty()) line(ticks.back());
  return text;
}

/// Lines `time mode` where the commanded mode changes.
std::string mode_steps(const std::vector<TickRecord>& ticks, const ModeSet& modes) {
  std::string text;
  for (std::size_t i = 0; i < ticks.size(); ++i)
    if (i == 0 || i + 1 == ticks.size() || ticks[i].applied.switches != ticks[i - 1].applied.switches)
      text += fmt::format("{:.3f} {}\n", ticks[i].sensors.time_s, modes.find(ticks[i].applied.switches));
  return text;
}

/// Distance of an axis's tics that divides `ticks`' range of a signal into three to eight: 1, 2 or 5 times a power
/// of 10.
double tic_distance(const std::vector<TickRecord>& ticks, const Signal& signal) {
  double low = 0, high = 0;  // every axis shows zero or comes near it
  for (const TickRecord& t : ticks) {
    low = std::min(low, signal(t));
    high = std::max(high, signal(t));
  }
  if (!(high - low > 1e-9) || !std::isfinite(high - low)) return 1.0;
  const double least = (high - low) / 7, power = std::pow(10.0, std::floor(std::log10(least)));
  for (const double digit : {1.0, 2.0, 5.0})
    if (digit * power >= least) return digit * power;
  return 10.0 * power;
}

/// The signals of the plots. Forces and errors are the plant's.
struct Signals {
  Signal desired_mm, actual_mm, error_mm, cylinder_n, motor_n;
};

Signals signals_of(const VariantConfig& variant, const ScenarioConfig& scenario) {
  const PneumaticActuator plant(scenario.mismatch.applied_to(variant.nominal));
  const auto desired = [](const TickRecord& t) { return 1e3 * t.decision.reference.axis[0].value; };
  const auto actual = [](const TickRecord& t) { return 1e3 * t.sensors.truth[position]; };
  return {desired, actual, [=](const TickRecord& t) { return desired(t) - actual(t); },
          [plant](const TickRecord& t) {
            return plant.cylinder_force(t.sensors.truth[pressure_a], t.sensors.truth[pressure_b]);
          },
          [](const TickRecord& t) { return t.applied.continuous[0]; }};
}

std::string title_text(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                       const Metrics& metrics) {
  std::string title = fmt::format("{}   |   {}", variant.name, scenario.name);
  if (scenario.noise) title += fmt::format(", seed {}", seed);
  title += fmt::format("   |   RMSE {:.3f} mm, largest error {:.2f} mm", metrics["rmse_mm"], metrics["mae_mm"]);
  if (!scenario.ideal_sensing) title += fmt::format("   (measured position: {:.3f} mm)", metrics["rmse_measured_mm"]);
  return title;
}

std::string mode_tics(const ModeSet& modes) {
  std::string tics;
  for (int m = 0; m < modes.size(); ++m)
    tics += fmt::format("{}{} {}", m ? ", " : "", gnuplot_quoted(modes.modes()[static_cast<std::size_t>(m)].name), m);
  return tics;
}

/// A panel below the first: no key.
Plot::Panel panel(const std::string& settings, const std::string& data, const std::string& how) {
  return {settings, data, {{"using 1:2 with " + how}}};
}

Plot plot_of(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed, const RunResult& result,
             double font) {
  const Signals signals = signals_of(variant, scenario);
  const ModeSet modes = valve_modes(variant.valves, variant.nominal);
  const auto& ticks = result.ticks;
  const double motor_n = std::max(variant.nominal.motor_force_limit_n(), 0.0), top = modes.size() - 1 + 0.4;
  const auto tics = [&](const Signal& signal) { return fmt::format("set ytics {}\n", tic_distance(ticks, signal)); };
  Plot plot{.width = 1280,
            .height = 800,
            .title = title_text(variant, scenario, seed, result.metrics),
            .layout = "5,1 margins screen 0.075, screen 0.865, screen 0.065, screen 0.935 spacing screen 0.018",
            .settings = fmt::format("set xrange [0:{}]\nset format x ''\nset format y '%5.4g'\n"
                                    "set offsets 0, 0, graph 0.05, graph 0.05\n",
                                    scenario.duration_s)};
  plot.panels.push_back(
      {"set ylabel 'position [mm]'\nset key at screen 0.995, graph 0.98 right vertical\n" + tics(signals.actual_mm),
       thinned(ticks, signals.actual_mm) + "\n\n" + thinned(ticks, signals.desired_mm),
       {{"index 0 using 1:2 with lines lw 2 lc rgb '#1f77b4'", "actual"},
        {"index 1 using 1:2 with lines lw 1.2 dt (8,6) lc rgb '#000000'", "desired"}}});
  plot.panels.push_back(panel("unset key\nset ylabel 'error [mm]'\n" + tics(signals.error_mm),
                              thinned(ticks, signals.error_mm), "lines lw 1.2 lc rgb '#d62728'"));
  plot.panels.back().curves.insert(plot.panels.back().curves.begin(), Plot::Curve{"0 with lines lc rgb '#909090'"});
  plot.panels.push_back(panel(fmt::format("set ylabel 'valve mode'\nset yrange [-0.4:{0}]\nset ytics 1\n"
                                          "set y2range [-0.4:{0}]\nset y2tics ({1}) scale 0 font ',{2}'\n",
                                          top, mode_tics(modes), font * (modes.size() > 4 ? 0.65 : 0.8)),
                              mode_steps(ticks, modes), "steps lw 0.8 lc rgb '#2ca02c'"));
  plot.panels.push_back(
      panel("unset y2tics\nset yrange [*:*]\nset ylabel 'cylinder force [N]'\n" + tics(signals.cylinder_n),
            thinned(ticks, signals.cylinder_n), "lines lw 1.2 lc rgb '#9467bd'"));
  plot.panels.push_back(panel(fmt::format("set ylabel 'motor force [N]'\nset ytics {0}\nset yrange [-{1}:{1}]\n"
                                          "set format x '%g'\nset xlabel 'time [s]' offset 0,0.4\n",
                                          motor_n > 0 ? motor_n / 2 : 1.0, 1.1 * std::max(motor_n, 1.0)),
                              thinned(ticks, signals.motor_n), "lines lw 1.2 lc rgb '#ff7f0e'"));
  return plot;
}

}  // namespace

void draw_figure(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                 const RunResult& result, const std::string& path, FigureFormat format) {
  draw(plot_of(variant, scenario, seed, result, format == FigureFormat::svg ? 13 : 10), path, format);
}

void draw_figure(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                 const std::string& path, FigureFormat format) {
  draw_figure(variant, scenario, seed, simulate(variant, scenario, seed), path, format);
}

}  // namespace solenoid
