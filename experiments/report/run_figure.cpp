#include "experiments/report/run_figure.hpp"

#include "core/actuator/valves.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/gnuplot.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::size_t spans = 500;

using Signal = std::function<double(const TickRecord&)>;

void write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream out(path);
  out << text;
  out.flush();
  if (!out) throw std::runtime_error(fmt::format("{} cannot be written", path.string()));
}

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
    if (i == 0 || i + 1 == ticks.size() || ticks[i].applied.coils != ticks[i - 1].applied.coils)
      text += fmt::format("{:.3f} {}\n", ticks[i].sensors.time_s, modes.find(ticks[i].applied.coils));
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
  const PneumaticActuator plant(scenario.mismatch.applied_to(variant.believed));
  const auto desired = [](const TickRecord& t) { return 1e3 * t.decision.reference.position; };
  const auto actual = [](const TickRecord& t) { return 1e3 * t.sensors.truth[position]; };
  return {desired, actual, [=](const TickRecord& t) { return desired(t) - actual(t); },
          [plant](const TickRecord& t) {
            return plant.cylinder_force(t.sensors.truth[pressure_a], t.sensors.truth[pressure_b]);
          },
          [](const TickRecord& t) { return t.applied.motor_force_n; }};
}

void write_data(const std::filesystem::path& folder, const Signals& signals, const ModeSet& modes,
                const std::vector<TickRecord>& ticks) {
  write_file(folder / "desired", thinned(ticks, signals.desired_mm));
  write_file(folder / "actual", thinned(ticks, signals.actual_mm));
  write_file(folder / "error", thinned(ticks, signals.error_mm));
  write_file(folder / "modes", mode_steps(ticks, modes));
  write_file(folder / "cylinder", thinned(ticks, signals.cylinder_n));
  write_file(folder / "motor", thinned(ticks, signals.motor_n));
}

std::string title_text(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                       const Metrics& metrics) {
  std::string title = fmt::format("{}   |   {}", variant.name, scenario.name);
  if (scenario.noise) title += fmt::format(", seed {}", seed);
  title += fmt::format("   |   RMSE {:.3f} mm, largest error {:.2f} mm", metrics.rmse_mm, metrics.mae_mm);
  if (!scenario.ideal_sensing) title += fmt::format("   (measured position: {:.3f} mm)", metrics.rmse_measured_mm);
  return title;
}

std::string mode_tics(const ModeSet& modes) {
  std::string tics;
  for (int m = 0; m < modes.size(); ++m)
    tics += fmt::format("{}{} {}", m ? ", " : "", gnuplot_quoted(modes.modes()[static_cast<std::size_t>(m)].name), m);
  return tics;
}

/// What the script says beside the curves.
struct Axes {
  std::string title;
  double duration_s, motor_limit_n;
  double position_tics, error_tics, cylinder_tics;
};

std::string script_text(const Axes& axes, const ModeSet& modes, FigureFormat format) {
  const bool svg = format == FigureFormat::svg;
  const std::string terminal = svg ? "svg size 1280,800 font 'Helvetica,13' background '#ffffff'"
                                   : "pngcairo size 1280,800 font 'Sans,10' background '#ffffff'";
  const double mode_font = (svg ? 13 : 10) * (modes.size() > 4 ? 0.65 : 0.8);
  return fmt::format(R"(set terminal {terminal} noenhanced
set output 'figure'
set encoding utf8
set multiplot layout 5,1 title {title} margins screen 0.075, screen 0.865, screen 0.065, screen 0.935 spacing screen 0.018
set xrange [0:{duration}]
set grid xtics ytics back lt 1 lw 0.7 lc rgb '#dddddd'
set border 3 lc rgb '#606060'
set tics nomirror out scale 0.5
set format x ''
set format y '%5.4g'
set offsets 0, 0, graph 0.05, graph 0.05
set ylabel 'position [mm]'
set ytics {position_tics}
set key at screen 0.995, graph 0.98 right vertical
plot 'actual' with lines lw 2 lc rgb '#1f77b4' title 'actual', 'desired' with lines lw 1.2 dt (8,6) lc rgb '#000000' title 'desired'
unset key
set ylabel 'error [mm]'
set ytics {error_tics}
plot 0 with lines lc rgb '#909090' notitle, 'error' with lines lw 1.2 lc rgb '#d62728'
set ylabel 'valve mode'
set yrange [-0.4:{top_mode}]
set ytics 1
set y2range [-0.4:{top_mode}]
set y2tics ({tics}) scale 0 font ',{mode_font}'
plot 'modes' with steps lw 0.8 lc rgb '#2ca02c'
unset y2tics
set yrange [*:*]
set ylabel 'cylinder force [N]'
set ytics {cylinder_tics}
plot 'cylinder' with lines lw 1.2 lc rgb '#9467bd'
set ylabel 'motor force [N]'
set ytics {motor_tics}
set yrange [-{motor}:{motor}]
set format x '%g'
set xlabel 'time [s]' offset 0,0.4
plot 'motor' with lines lw 1.2 lc rgb '#ff7f0e'
unset multiplot
set output
)",
                     fmt::arg("terminal", terminal), fmt::arg("title", gnuplot_quoted(axes.title)),
                     fmt::arg("duration", axes.duration_s), fmt::arg("position_tics", axes.position_tics),
                     fmt::arg("error_tics", axes.error_tics), fmt::arg("cylinder_tics", axes.cylinder_tics),
                     fmt::arg("motor_tics", axes.motor_limit_n > 0 ? axes.motor_limit_n / 2 : 1.0),
                     fmt::arg("top_mode", modes.size() - 1 + 0.4), fmt::arg("tics", mode_tics(modes)),
                     fmt::arg("mode_font", mode_font), fmt::arg("motor", 1.1 * std::max(axes.motor_limit_n, 1.0)));
}

/// Beside its final place first, so that a full disk leaves no half of a figure.
void put_in_place(const std::filesystem::path& from, const std::filesystem::path& to) {
  namespace fs = std::filesystem;
  const fs::path part = to.string() + ".part";
  std::error_code error, ignored;
  if (fs::is_directory(to, ignored)) error = std::make_error_code(std::errc::is_a_directory);
  if (!error) fs::copy_file(from, part, fs::copy_options::overwrite_existing, error);
  if (!error) fs::rename(part, to, error);
  if (!error) return;
  fs::remove(part, ignored);
  throw ConfigError(
      fmt::format("figure {} cannot be written: {} (allowed: a file in a folder that exists and has room)", to.string(),
                  error.message()));
}

}  // namespace

void draw_figure(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                 const RunResult& result, const std::string& path, FigureFormat format) {
  const Signals signals = signals_of(variant, scenario);
  const ModeSet modes = valve_modes(variant.valves, variant.believed);
  const Axes axes = {title_text(variant, scenario, seed, result.metrics),
                     scenario.duration_s,
                     variant.believed.motor_force_limit_n(),
                     tic_distance(result.ticks, signals.actual_mm),
                     tic_distance(result.ticks, signals.error_mm),
                     tic_distance(result.ticks, signals.cylinder_n)};
  const TemporaryFolder folder;
  write_data(folder.path(), signals, modes, result.ticks);
  write_file(folder.path() / "script", script_text(axes, modes, format));
  run_gnuplot(folder.path(), "script");
  put_in_place(folder.path() / "figure", path);
}

void draw_figure(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                 const std::string& path, FigureFormat format) {
  draw_figure(variant, scenario, seed, simulate(variant, scenario, seed), path, format);
}

}  // namespace solenoid
