#include "experiments/systems/actuator/sizing/size_output.hpp"

#include <array>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// The printed speed of the load factor, which is no step of its own.
constexpr const char* load_speed = "load_speed";

struct Description {
  const char *name, *meaning, *unit, *equation;
};
enum Step : std::size_t {
  acceleration,
  arm_inertia_step,
  payload_inertia_step,
  acceleration_torque,
  torque,
  force,
  cylinder_force,
  bore,
  motor_torque_step,
  speed,
  pitch_speed,
  load_factor,
  stress,
  safety,
  steps
};
constexpr std::array<Description, steps> descriptions = {
    {{"acceleration", "largest acceleration", "rad/s2", "(3.3)"},
     {"arm_inertia", "inertia of the arm", "kg m2", "(3.4)"},
     {"payload_inertia", "inertia of the payload", "kg m2", "(3.5)"},
     {"acceleration_torque", "largest torque to accelerate", "N m", "(3.7)"},
     {"torque", "largest torque", "N m", "(3.9)"},
     {"force", "largest force at the pitch line", "N", "(3.10)"},
     {"cylinder_force", "largest force of the cylinder", "N", "(3.11)"},
     {"bore", "least bore", "mm", "(3.14)"},
     {"motor_torque", "torque of the motor", "N m", "(3.15)"},
     {"speed", "largest speed", "rad/s", "(A.2)"},
     {"pitch_speed", "speed of the pitch line", "m/s", "(A.3)"},
     {"load_factor", "gear load factor", "1", "(A.6)"},
     {"tooth_stress", "stress of the gear's tooth", "MPa", "(A.7)"},
     {"safety_factor", "safety factor", "1", "(A.9)"}}};

std::array<double, steps> computed_values(const Sizing& s) {
  return {s.acceleration_rad_s2,
          s.arm_inertia,
          s.payload_inertia,
          s.acceleration_torque_nm,
          s.torque_nm,
          s.force_n,
          s.cylinder_n,
          1e3 * s.bore_m,
          s.motor_nm,
          s.speed_rad_s,
          s.pitch_speed_m_s,
          s.gear.load_factor,
          1e-6 * s.gear.stress_pa,
          s.gear.safety};
}

/// Each step from the `before` it: printed values where there are some.
std::array<double, steps> stepped_values(const SizingTask& task, const std::array<double, steps>& computed,
                                         const std::array<double, steps>& before) {
  std::array<double, steps> v = computed;  // steps that start from data alone stay as they are
  v[acceleration_torque] = (before[arm_inertia_step] + before[payload_inertia_step]) * before[acceleration];
  v[force] = force_at_pitch(before[torque], task.gear_diameter_m());
  v[cylinder_force] = before[force] - (task.vertical ? task.slide_mass_kg * task.gravity : 0.0);
  v[bore] = 1e3 * bore_for_force(std::abs(before[cylinder_force]), task.supply_gauge_pa);
  v[motor_torque_step] =
      motor_torque(task.motor_share, before[torque], task.pinion_diameter_m(), task.gear_diameter_m());
  v[pitch_speed] = before[speed] * task.gear_diameter_m() / 2;
  v[load_factor] = barth_factor(before[speed]);  // rad/s, as (A.6) has it
  v[stress] = 1e-6 * tooth_stress(before[load_factor], before[force], task.face_width_m, task.module_m,
                                  lewis_form_factor(task.gear_teeth));
  v[safety] = 1e-6 * task.tooth_strength_pa / before[stress];
  return v;
}

/// Beyond half of the last digit printed, with a little for rounding.
bool beyond(const PrintedFigure& printed, double value) {
  return std::abs(printed.value - value) > printed.half_digit() * (1 + 1e-6);
}

std::optional<double> printed_value(const SizingInput& input, const std::string& name) {
  const auto found = input.printed.find(name);
  return found == input.printed.end() ? std::nullopt : std::optional(found->second.value);
}

}  // namespace

bool SizingQuantity::own_difference() const { return printed && stepped && beyond(*printed, *stepped); }

bool SizingQuantity::differs() const { return printed && beyond(*printed, computed); }

std::vector<SizingQuantity> sizing_quantities(const SizingInput& input) {
  const std::array<double, steps> computed = computed_values(size_actuator(input.task));
  std::array<double, steps> before = computed;
  for (std::size_t i = 0; i < steps; ++i) before[i] = printed_value(input, descriptions[i].name).value_or(computed[i]);
  const std::array<double, steps> stepped = stepped_values(input.task, computed, before);
  std::vector<SizingQuantity> quantities;
  for (std::size_t i = 0; i < steps; ++i) {
    const Description& d = descriptions[i];
    SizingQuantity q{d.name, d.meaning, d.unit, d.equation, {}, {}, computed[i]};
    if (const auto found = input.printed.find(d.name); found != input.printed.end()) {
      q.printed = found->second;
      q.stepped = stepped[i];
    }
    quantities.push_back(std::move(q));
  }
  return quantities;
}

std::vector<std::string> printable_quantities() {
  std::vector<std::string> names;
  for (const Description& d : descriptions) names.emplace_back(d.name);
  names.emplace_back(load_speed);
  return names;
}

std::vector<ToothReading> tooth_readings(const SizingInput& input) {
  const SizingTask& task = input.task;
  const Sizing s = size_actuator(task);
  std::vector<ToothReading> readings;
  if (const auto printed_force = printed_value(input, "force")) {
    const double f = *printed_force;
    const int teeth = task.gear_teeth;
    if (const auto v = printed_value(input, load_speed))
      readings.push_back(read_tooth(task, "as printed", *v, "as if m/s", f, teeth));
    if (const auto v = printed_value(input, "speed"))
      readings.push_back(read_tooth(task, "corrected to (A.2)", *v, "rad/s", f, teeth));
    if (const auto v = printed_value(input, "pitch_speed"))
      readings.push_back(read_tooth(task, "standard formula, (A.3)", *v, "m/s", f, teeth));
  }
  readings.push_back(read_tooth(task, "equations, rad/s", s.speed_rad_s, "rad/s", s.gear.force_n, task.gear_teeth));
  readings.push_back(s.gear);
  readings.back().name = "equations, standard formula";
  readings.push_back(s.pinion);
  readings.back().name = "pinion, standard formula";
  return readings;
}

std::vector<std::string> sizing_differences(const SizingInput& input) {
  std::vector<std::string> sentences;
  for (const SizingQuantity& q : sizing_quantities(input)) {
    if (!q.printed) continue;
    const bool own = q.own_difference();
    if (!own && q.printed->note.empty()) continue;
    const std::string unit = q.unit == "1" ? "" : " " + q.unit;
    std::string text = fmt::format("{} {}: printed {}{}, ", q.meaning, q.printed->at, q.printed->text, unit);
    text += own ? fmt::format("but its own step gives {:.4g}", *q.stepped) : "as its own step gives";
    if (q.differs()) text += fmt::format("; the data through every equation give {:.4g}", q.computed);
    sentences.push_back(text + (q.printed->note.empty() ? "" : ". Note: " + q.printed->note));
  }
  return sentences;
}

}  // namespace solenoid
