#include "experiments/sizing/size_output.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/gnuplot.hpp"
#include "experiments/base/text_table.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Align = TextTable::Align;

constexpr double millimetre = 1e-3;
constexpr int curve_points = 401;

std::string number(double value) { return fmt::format("{:.4g}", value); }

std::string quantities_text(const SizingInput& input, bool colour) {
  const bool printed = !input.printed.empty();
  std::vector<TextTable::Column> columns = {{"", Align::left}, {"unit", Align::left}, {"equation", Align::left}};
  if (printed) columns.insert(columns.end(), {{"printed"}, {"its own step"}});
  columns.push_back({"equations"});
  TextTable table(columns);
  for (const SizingQuantity& q : sizing_quantities(input)) {
    std::vector<TextTable::Cell> cells = {{q.meaning}, {q.unit}, {q.equation}};
    if (printed) {
      cells.push_back({q.printed ? q.printed->text : "", q.own_difference()});
      cells.push_back({q.stepped ? number(*q.stepped) : ""});
    }
    cells.push_back({number(q.computed)});
    table.add_row(cells);
  }
  return table.text(colour);
}

std::string teeth_text(const SizingInput& input, bool colour) {
  TextTable table({{"tooth (A.6)-(A.9)", Align::left},
                   {"speed"},
                   {"taken as", Align::left},
                   {"force N"},
                   {"load factor"},
                   {"stress MPa"},
                   {"safety factor"}});
  for (const ToothReading& r : tooth_readings(input))
    table.add_row(std::vector<std::string>{r.name, number(r.speed), r.speed_unit, fmt::format("{:.2f}", r.force_n),
                                           fmt::format("{:.4g}", r.load_factor),
                                           fmt::format("{:.1f}", 1e-6 * r.stress_pa), fmt::format("{:.2f}", r.safety)});
  return table.text(colour);
}

std::string millimetres(const std::optional<double>& metres) {
  return metres ? fmt::format("{:.4g} mm", *metres / millimetre) : "none of the standard bores";
}

/// What to buy, and what the formulas leave out.
std::string choice_text(const SizingTask& task, const Sizing& s) {
  std::string text = fmt::format("Peak at {:.3f} s and {:.1f} deg. Next standard bore: {}.\n", s.peak.time_s,
                                 s.peak.angle_rad * 180 / std::numbers::pi, millimetres(s.standard_bore_m));
  text += fmt::format(
      "With the slide's inertia, friction and the way back, which chapter 3 leaves out: {:.2f} N pushing, {:.2f} N "
      "pulling;\nleast bore {:.4g} mm, next standard one {}.\n",
      s.full.push_n, s.full.pull_n, s.bore_full_m / millimetre, millimetres(s.standard_bore_full_m));
  if (task.bore_m) {
    const double has = force_of_bore(*task.bore_m, task.supply_gauge_pa);
    text += fmt::format(
        "The chosen bore of {:.4g} mm has {:.2f} N: {:+.1f} % beyond the formulas' force, {:+.1f} % beyond the full "
        "one.\n",
        *task.bore_m / millimetre, has, 100 * (has / std::abs(s.cylinder_n) - 1),
        100 * (has / std::max(s.full.push_n, s.full.pull_n) - 1));
  }
  text += fmt::format("Stroke needed {:.1f} mm of {:.1f} mm{}.\n", s.stroke_m / millimetre, task.stroke_m / millimetre,
                      s.stroke_m > task.stroke_m ? ": too short" : "");
  return text;
}

nlohmann::ordered_json or_null(const std::optional<double>& value, double unit = 1.0) {
  return value ? nlohmann::ordered_json(*value / unit) : nlohmann::ordered_json(nullptr);
}

}  // namespace

std::string sizing_text(const SizingInput& input, bool colour) {
  const Sizing s = size_actuator(input.task);
  std::string text = fmt::format("Sizing of '{}': chapter 3 and appendix A.\n\n", input.task.name) +
                     quantities_text(input, colour) + "\n" + teeth_text(input, colour) + "\n" +
                     choice_text(input.task, s);
  const std::vector<std::string> differences = sizing_differences(input);
  if (!differences.empty()) text += "\nWhere the printed figures and their own equations part (*: the step itself):\n";
  for (const std::string& sentence : differences) text += "- " + sentence + "\n";
  return text;
}

std::string sizing_csv(const SizingInput& input) {
  std::string text = "quantity,unit,equation,printed,own_step,equations\n";
  for (const SizingQuantity& q : sizing_quantities(input))
    text += fmt::format("{},{},{},{},{},{}\n", q.name, q.unit, q.equation, q.printed ? q.printed->text : "",
                        q.stepped ? fmt::format("{}", *q.stepped) : "", q.computed);
  for (const ToothReading& r : tooth_readings(input)) {
    text += fmt::format("\"tooth_stress: {}\",MPa,(A.7),,,{}\n", r.name, 1e-6 * r.stress_pa);
    text += fmt::format("\"safety_factor: {}\",1,(A.9),,,{}\n", r.name, r.safety);
  }
  return text;
}

std::string sizing_json(const SizingInput& input) {
  const Sizing s = size_actuator(input.task);
  nlohmann::ordered_json json = {{"task", input.task.name}};
  for (const SizingQuantity& q : sizing_quantities(input))
    json["quantities"].push_back({{"name", q.name},
                                  {"unit", q.unit},
                                  {"equation", q.equation},
                                  {"printed", q.printed ? nlohmann::ordered_json(q.printed->value) : nullptr},
                                  {"own_step", or_null(q.stepped)},
                                  {"equations", q.computed},
                                  {"own_difference", q.own_difference()}});
  for (const ToothReading& r : tooth_readings(input))
    json["teeth"].push_back({{"name", r.name},
                             {"speed", r.speed},
                             {"speed_unit", r.speed_unit},
                             {"force_n", r.force_n},
                             {"load_factor", r.load_factor},
                             {"stress_mpa", 1e-6 * r.stress_pa},
                             {"safety_factor", r.safety}});
  json["peak"] = {{"time_s", s.peak.time_s}, {"angle_rad", s.peak.angle_rad}, {"torque_nm", s.torque_nm}};
  json["standard_bore_mm"] = or_null(s.standard_bore_m, millimetre);
  json["full"] = {{"push_n", s.full.push_n},
                  {"pull_n", s.full.pull_n},
                  {"bore_mm", s.bore_full_m / millimetre},
                  {"standard_bore_mm", or_null(s.standard_bore_full_m, millimetre)}};
  json["stroke_mm"] = s.stroke_m / millimetre;
  json["differences"] = sizing_differences(input);
  for (const ArmTorque& t : torque_curve(input.task, curve_points))
    json["curve"].push_back({{"time_s", t.time_s},
                             {"angle_rad", t.angle_rad},
                             {"acceleration_nm", t.acceleration_nm},
                             {"gravity_nm", t.gravity_nm},
                             {"total_nm", t.total_nm()}});
  return json.dump(1) + "\n";
}

void draw_torque_curve(const SizingInput& input, const std::string& path) {
  const bool svg = path.ends_with(".svg");
  if (!svg && !path.ends_with(".png")) throw ConfigError(path + ": not a figure's name (allowed: *.svg or *.png)");
  std::string data;
  for (const ArmTorque& t : torque_curve(input.task, curve_points))
    data += fmt::format("{} {} {} {}\n", t.time_s, t.acceleration_nm, t.gravity_nm, t.total_nm());
  const ArmTorque peak = torque_peak(input.task);
  const auto printed = input.printed.find("torque");
  const std::string line = printed == input.printed.end()
                               ? ""
                               : fmt::format(", {0} with lines dt (6,4) lc rgb '#7f7f7f' title 'printed, {1} N m'",
                                             printed->second.value, printed->second.text);
  const std::string script = fmt::format(
      R"(set terminal {} noenhanced
set output 'figure'
set encoding utf8
set grid back lt 1 lw 0.7 lc rgb '#dddddd'
set border 3 lc rgb '#606060'
set tics nomirror out scale 0.5
set key outside right top Left reverse samplen 2
set title {}
set xlabel 'time, s'
set ylabel 'torque, N m'
set offsets 0, 0, graph 0.05, graph 0.05
plot 'data' using 1:4 with lines lw 2 lc rgb '#1f77b4' title 'total (3.9)', \
     '' using 1:3 with lines lw 1.5 lc rgb '#2ca02c' title 'gravity (3.8)', \
     '' using 1:2 with lines lw 1.5 lc rgb '#ff7f0e' title 'acceleration (3.6)', \
     '-' using 1:2 with points pt 7 ps 0.8 lc rgb '#d62728' title 'peak, {:.3f} N m'{}
{} {}
e
set output
)",
      svg ? "svg size 860,420 font 'Helvetica,13' background '#ffffff'"
          : "pngcairo size 860,420 font 'Sans,10' background '#ffffff'",
      gnuplot_quoted(fmt::format("torque of the arm, {}", input.task.name)), peak.total_nm(), line, peak.time_s,
      peak.total_nm());
  draw_with_gnuplot({{"data", data}}, script, path);
}

}  // namespace solenoid
