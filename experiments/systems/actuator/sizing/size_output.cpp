#include "experiments/systems/actuator/sizing/size_output.hpp"

#include "experiments/base/result.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Column = Table::Column;

constexpr int curve_points = 401;

Table quantities(const SizingInput& input) {
  const bool printed = !input.printed.empty();
  Table table{.name = "quantities",
              .columns = {Column("name"), Column("", "quantity", "<"), Column("unit", "unit", "<"),
                          Column("equation", "equation", "<"), Column("printed"), Column("", printed ? "printed" : ""),
                          Column("own_step", printed ? "its own step" : "", ".4g"),
                          Column("equations", "equations", ".4g"), Column("own_difference")}};
  for (const SizingQuantity& q : sizing_quantities(input))
    table.add({q.name,
               q.meaning,
               q.unit,
               q.equation,
               q.printed ? Json(q.printed->value) : Json(),
               {q.printed ? q.printed->text : "", q.own_difference()},
               q.stepped,
               q.computed,
               q.own_difference()});
  return table;
}

Table teeth(const SizingInput& input) {
  Table table{.name = "teeth",
              .columns = {Column("name", "tooth (A.6)-(A.9)", "<"), Column("speed", "speed", ".4g"),
                          Column("speed_unit", "taken as", "<"), Column("force_n", "force N", ".2f"),
                          Column("load_factor", "load factor", ".4g"), Column("stress_mpa", "stress MPa", ".1f"),
                          Column("safety_factor", "safety factor", ".2f")}};
  for (const ToothReading& r : tooth_readings(input))
    table.add({r.name, r.speed, r.speed_unit, r.force_n, r.load_factor, 1e-6 * r.stress_pa, r.safety});
  return table;
}

/// A line a number: the quantities, then stress and safety of each reading of a tooth.
Table flat(const SizingInput& input) {
  Table table{.columns = {Column("quantity"), Column("unit"), Column("equation"), Column("printed"), Column("own_step"),
                          Column("equations")}};
  for (const SizingQuantity& q : sizing_quantities(input))
    table.add({q.name, q.unit, q.equation, q.printed ? q.printed->text : "", q.stepped, q.computed});
  for (const ToothReading& r : tooth_readings(input)) {
    table.add({"tooth_stress: " + r.name, "MPa", "(A.7)", nullptr, nullptr, 1e-6 * r.stress_pa});
    table.add({"safety_factor: " + r.name, "1", "(A.9)", nullptr, nullptr, r.safety});
  }
  return table;
}

std::string millimetres(const std::optional<double>& metres) {
  return metres ? fmt::format("{:.4g} mm", *metres / millimetre) : "none of the standard bores";
}

/// What to buy, and what the formulas leave out.
std::vector<std::string> choice(const SizingTask& task, const Sizing& s) {
  std::vector<std::string> lines = {
      fmt::format("Peak at {:.3f} s and {:.1f} deg. Next standard bore: {}.", s.peak.time_s,
                  s.peak.angle_rad * 180 / std::numbers::pi, millimetres(s.standard_bore_m)),
      fmt::format("With the slide's inertia, friction and the way back, which chapter 3 leaves out: {:.2f} N pushing, "
                  "{:.2f} N pulling;\nleast bore {:.4g} mm, next standard one {}.",
                  s.full.push_n, s.full.pull_n, s.bore_full_m / millimetre, millimetres(s.standard_bore_full_m))};
  if (task.bore_m) {
    const double has = force_of_bore(*task.bore_m, task.supply_gauge_pa);
    lines.push_back(fmt::format(
        "The chosen bore of {:.4g} mm has {:.2f} N: {:+.1f} % beyond the formulas' force, {:+.1f} % beyond the full "
        "one.",
        *task.bore_m / millimetre, has, 100 * (has / std::abs(s.cylinder_n) - 1),
        100 * (has / std::max(s.full.push_n, s.full.pull_n) - 1)));
  }
  lines.push_back(fmt::format("Stroke needed {:.1f} mm of {:.1f} mm{}.", s.stroke_m / millimetre,
                              task.stroke_m / millimetre, s.stroke_m > task.stroke_m ? ": too short" : ""));
  return lines;
}

/// Figure 3-3: the torques against time, with the peak.
Plot plot_of(const SizingInput& input, const std::vector<ArmTorque>& curve) {
  const ArmTorque peak = torque_peak(input.task);
  Plot::Panel panel{
      "set key outside right top Left reverse samplen 2\nset xlabel 'time, s'\nset ylabel 'torque, N m'\n"
      "set offsets 0, 0, graph 0.05, graph 0.05\n",
      fmt::format("{} {}\n\n\n", peak.time_s, peak.total_nm()),
      {{"index 1 using 1:4 with lines lw 2 lc rgb '#1f77b4'", "total (3.9)"},
       {"index 1 using 1:3 with lines lw 1.5 lc rgb '#2ca02c'", "gravity (3.8)"},
       {"index 1 using 1:2 with lines lw 1.5 lc rgb '#ff7f0e'", "acceleration (3.6)"},
       {"index 0 using 1:2 with points pt 7 ps 0.8 lc rgb '#d62728'",
        fmt::format("peak, {:.3f} N m", peak.total_nm())}}};
  for (const ArmTorque& t : curve)
    panel.data += fmt::format("{} {} {} {}\n", t.time_s, t.acceleration_nm, t.gravity_nm, t.total_nm());
  if (const auto printed = input.printed.find("torque"); printed != input.printed.end())
    panel.curves.push_back({fmt::format("{} with lines dt (6,4) lc rgb '#7f7f7f'", printed->second.value),
                            fmt::format("printed, {} N m", printed->second.text)});
  return {.width = 860, .title = "torque of the arm, " + input.task.name, .panels = {panel}};
}

Json or_null(const std::optional<double>& metres) { return metres ? Json(*metres / millimetre) : Json(); }

}  // namespace

Result result_of(const SizingInput& input) {
  const Sizing s = size_actuator(input.task);
  const std::vector<ArmTorque> curve = torque_curve(input.task, curve_points);
  const std::vector<std::string> differences = sizing_differences(input);
  Table torques{.name = "curve",
                .columns = {Column("time_s"), Column("angle_rad"), Column("acceleration_nm"), Column("gravity_nm"),
                            Column("total_nm")}};
  for (const ArmTorque& t : curve) torques.add({t.time_s, t.angle_rad, t.acceleration_nm, t.gravity_nm, t.total_nm()});
  Result result{
      .title = fmt::format("Sizing of '{}': chapter 3 and appendix A.", input.task.name),
      .facts = {{"task", input.task.name},
                {"peak", {{"time_s", s.peak.time_s}, {"angle_rad", s.peak.angle_rad}, {"torque_nm", s.torque_nm}}},
                {"standard_bore_mm", or_null(s.standard_bore_m)},
                {"full",
                 {{"push_n", s.full.push_n},
                  {"pull_n", s.full.pull_n},
                  {"bore_mm", s.bore_full_m / millimetre},
                  {"standard_bore_mm", or_null(s.standard_bore_full_m)}}},
                {"stroke_mm", s.stroke_m / millimetre},
                {"differences", differences}},
      .tables = {quantities(input), teeth(input), torques},
      .flat = flat(input),
      .notes = choice(input.task, s),
      .plot = plot_of(input, curve)};
  if (!differences.empty())
    result.notes.push_back("\nWhere the printed figures and their own equations part (*: the step itself):");
  for (const std::string& sentence : differences) result.notes.push_back("- " + sentence);
  return result;
}

}  // namespace solenoid
