#include "experiments/report/figure.hpp"

#include "core/actuator/valves.hpp"
#include "core/config/reader.hpp"
#include "experiments/report/gnuplot.hpp"

#include <algorithm>
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

void write_data(const std::filesystem::path& folder, const VariantConfig& variant, const ScenarioConfig& scenario,
                const std::vector<TickRecord>& ticks) {
  ActuatorParameters parameters = scenario.mismatch.applied_to(variant.believed);
  const PneumaticActuator model(parameters);
  const auto desired = [](const TickRecord& t) { return 1e3 * t.decision.reference.position; };
  const auto actual = [](const TickRecord& t) { return 1e3 * t.sensors.truth[position]; };
  write_file(folder / "desired", thinned(ticks, desired));
  write_file(folder / "actual", thinned(ticks, actual));
  write_file(folder / "error", thinned(ticks, [&](const TickRecord& t) { return desired(t) - actual(t); }));
  write_file(folder / "modes", mode_steps(ticks, valve_modes(variant.valves, parameters)));
  write_file(folder / "cylinder", thinned(ticks, [&](const TickRecord& t) {
               return model.cylinder_force(t.sensors.truth[pressure_a], t.sensors.truth[pressure_b]);
             }));
  write_file(folder / "motor", thinned(ticks, [](const TickRecord& t) { return t.applied.motor_force_n; }));
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

std::string script_text(const std::string& title, const ModeSet& modes, double duration_s, double motor_limit_n,
                        FigureFormat format) {
  const std::string terminal = format == FigureFormat::svg
                                   ? "svg size 1280,800 font 'Helvetica,13' background '#ffffff'"
                                   : "pngcairo size 1280,800 font 'Sans,10' background '#ffffff'";
  const double mode_font = modes.size() > 4 ? 0.65 : 0.8;
  return fmt::format(R"(set terminal {terminal} noenhanced
set output 'figure'
set encoding utf8
set multiplot layout 5,1 title {title} margins screen 0.075, screen 0.865, screen 0.065, screen 0.935 spacing screen 0.018
set xrange [0:{duration}]
set grid lc rgb '#d8d8d8'
set border 3 lc rgb '#606060'
set tics nomirror out scale 0.5
set format x ''
set offsets 0, 0, graph 0.05, graph 0.05
set key above right horizontal height 0 samplen 2
set ylabel 'position [mm]'
set key at screen 0.995, graph 0.98 right vertical
plot 'actual' with lines lw 2 lc rgb '#1f77b4' title 'actual', 'desired' with lines lw 1.2 dt (8,6) lc rgb '#000000' title 'desired'
unset key
set ylabel 'error [mm]'
plot 0 with lines lc rgb '#909090' notitle, 'error' with lines lw 1.2 lc rgb '#d62728'
set ylabel 'valve mode'
set yrange [-0.4:{top_mode}]
set ytics 1
set y2range [-0.4:{top_mode}]
set y2tics ({tics}) scale 0 font ',{mode_font}'
plot 'modes' with steps lw 0.8 lc rgb '#2ca02c'
unset y2tics
set yrange [*:*]
set ytics autofreq
set ylabel 'cylinder force [N]'
plot 'cylinder' with lines lw 1.2 lc rgb '#9467bd'
set ylabel 'motor force [N]'
set yrange [-{motor}:{motor}]
set format x '%g'
set xlabel 'time [s]' offset 0,0.4
plot 'motor' with lines lw 1.2 lc rgb '#ff7f0e'
unset multiplot
set output
)",
                     fmt::arg("terminal", terminal), fmt::arg("title", gnuplot_quoted(title)),
                     fmt::arg("duration", duration_s), fmt::arg("top_mode", modes.size() - 1 + 0.4),
                     fmt::arg("tics", mode_tics(modes)),
                     fmt::arg("mode_font", format == FigureFormat::svg ? 13 * mode_font : 10 * mode_font),
                     fmt::arg("motor", 1.1 * std::max(motor_limit_n, 1.0)));
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
  const TemporaryFolder folder;
  write_data(folder.path(), variant, scenario, result.ticks);
  write_file(folder.path() / "script", script_text(title_text(variant, scenario, seed, result.metrics),
                                                   valve_modes(variant.valves, variant.believed), scenario.duration_s,
                                                   variant.believed.motor_force_limit_n(), format));
  run_gnuplot(folder.path(), "script");
  put_in_place(folder.path() / "figure", path);
}

void draw_figure(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                 const std::string& path, FigureFormat format) {
  draw_figure(variant, scenario, seed, simulate(variant, scenario, seed), path, format);
}

}  // namespace solenoid
