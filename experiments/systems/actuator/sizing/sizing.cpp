#include "experiments/systems/actuator/sizing/sizing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double pi = std::numbers::pi;

/// Position, speed and acceleration of a law from 0 to 1 in unit time.
ArmSample unit_motion(ArmMotionLaw law, double s) {
  switch (law) {
    case ArmMotionLaw::cycloidal:
      return {s - std::sin(2 * pi * s) / (2 * pi), 1 - std::cos(2 * pi * s), 2 * pi * std::sin(2 * pi * s)};
    case ArmMotionLaw::quintic:
      return {s * s * s * (10 + s * (-15 + 6 * s)), 30 * s * s * (1 - s) * (1 - s), 60 * s * (1 - s) * (1 - 2 * s)};
    case ArmMotionLaw::cosine:
      return {(1 - std::cos(pi * s)) / 2, pi / 2 * std::sin(pi * s), pi * pi / 2 * std::cos(pi * s)};
  }
  return {};
}

/// The largest value of f on [0, end]: the best of a grid, then a golden section around it.
template <typename F>
double argmax(const F& f, double end) {
  constexpr int grid = 2000;
  constexpr double golden = 0.6180339887498949;
  int best = 0;
  for (int i = 1; i <= grid; ++i)
    if (f(end * i / grid) > f(end * best / grid)) best = i;
  double low = end * std::max(best - 1, 0) / grid, high = end * std::min(best + 1, grid) / grid;
  while (high - low > 1e-6 * end) {
    const double a = high - golden * (high - low), b = low + golden * (high - low);
    if (f(a) < f(b))
      low = a;
    else
      high = b;
  }
  const double middle = (low + high) / 2, at_grid = end * best / grid;
  return f(middle) > f(at_grid) ? middle : at_grid;
}

struct FormFactor {
  int teeth;
  double y;
};
constexpr std::array form_factors = {
    FormFactor{12, 0.245}, FormFactor{13, 0.261},  FormFactor{14, 0.277},  FormFactor{15, 0.290},
    FormFactor{16, 0.296}, FormFactor{17, 0.303},  FormFactor{18, 0.309},  FormFactor{19, 0.314},
    FormFactor{20, 0.322}, FormFactor{21, 0.328},  FormFactor{22, 0.331},  FormFactor{24, 0.337},
    FormFactor{26, 0.346}, FormFactor{28, 0.353},  FormFactor{30, 0.359},  FormFactor{34, 0.371},
    FormFactor{38, 0.384}, FormFactor{43, 0.397},  FormFactor{50, 0.409},  FormFactor{60, 0.422},
    FormFactor{75, 0.435}, FormFactor{100, 0.447}, FormFactor{150, 0.460}, FormFactor{300, 0.472},
    FormFactor{400, 0.480}};
constexpr double rack_form_factor = 0.485;

}  // namespace

ArmSample arm_at(const ArmMotion& motion, double time_s) {
  const ArmSample unit = unit_motion(motion.law, std::clamp(time_s / motion.move_s, 0.0, 1.0));
  const double rate = motion.total_rad / motion.move_s;
  return {motion.from_rad + motion.total_rad * unit.angle_rad, rate * unit.speed_rad_s,
          rate / motion.move_s * unit.acceleration_rad_s2};
}

double largest_speed(const ArmMotion& motion) {
  const double unit = motion.law == ArmMotionLaw::cycloidal ? 2.0
                      : motion.law == ArmMotionLaw::quintic ? 1.875
                                                            : pi / 2;
  return unit * std::abs(motion.total_rad) / motion.move_s;
}

double largest_acceleration(const ArmMotion& motion) {
  const double unit = motion.law == ArmMotionLaw::cycloidal ? 2 * pi
                      : motion.law == ArmMotionLaw::quintic ? 10 / std::sqrt(3.0)
                                                            : pi * pi / 2;
  return unit * std::abs(motion.total_rad) / (motion.move_s * motion.move_s);
}

double arm_inertia(const SizingTask& task) { return task.arm_mass_kg * task.arm_length_m * task.arm_length_m / 3; }

double payload_inertia(const SizingTask& task) { return task.payload_kg * task.arm_length_m * task.arm_length_m; }

ArmTorque torque_at(const SizingTask& task, double time_s) {
  const ArmSample arm = arm_at(task.motion, time_s);
  const double moment = (task.arm_mass_kg / 2 + task.payload_kg) * task.arm_length_m;
  return {time_s, arm.angle_rad, (arm_inertia(task) + payload_inertia(task)) * arm.acceleration_rad_s2,
          task.vertical ? moment * task.gravity * std::sin(arm.angle_rad) : 0.0};
}

std::vector<ArmTorque> torque_curve(const SizingTask& task, int points) {
  std::vector<ArmTorque> curve;
  for (int i = 0; i < points; ++i) curve.push_back(torque_at(task, task.motion.move_s * i / (points - 1)));
  return curve;
}

ArmTorque torque_peak(const SizingTask& task) {
  const auto magnitude = [&](double t) { return std::abs(torque_at(task, t).total_nm()); };
  return torque_at(task, argmax(magnitude, task.motion.move_s));
}

double force_at_pitch(double torque_nm, double pitch_diameter_m) { return torque_nm / (pitch_diameter_m / 2); }

double bore_for_force(double force_n, double gauge_pa, double rod_m) {
  if (force_n < 0) throw std::invalid_argument("a bore for a negative force (allowed: 0 or more)");
  return std::sqrt(4 * force_n / (pi * gauge_pa) + rod_m * rod_m);
}

double force_of_bore(double bore_m, double gauge_pa, double rod_m) {
  return gauge_pa * pi / 4 * (bore_m * bore_m - rod_m * rod_m);
}

std::optional<double> next_standard(const std::vector<double>& rising, double least) {
  const auto found = std::ranges::lower_bound(rising, least);
  return found == rising.end() ? std::nullopt : std::optional(*found);
}

double motor_torque(double share, double torque_nm, double pinion_m, double gear_m) {
  return share * torque_nm * pinion_m / gear_m;
}

double lewis_form_factor(int teeth) {
  if (teeth < form_factors.front().teeth)
    throw std::invalid_argument(fmt::format("{} teeth have no form factor (allowed: 12 or more)", teeth));
  for (std::size_t i = 1; i < form_factors.size(); ++i) {
    const auto [n0, y0] = form_factors[i - 1];
    const auto [n1, y1] = form_factors[i];
    if (teeth <= n1) return y0 + (y1 - y0) * (1.0 / n0 - 1.0 / teeth) / (1.0 / n0 - 1.0 / n1);
  }
  const auto [n, y] = form_factors.back();  // a rack has infinitely many
  return rack_form_factor - (rack_form_factor - y) * n / teeth;
}

double barth_factor(double speed) { return (6.1 + speed) / 6.1; }

double tooth_stress(double load_factor, double force_n, double face_width_m, double module_m, double form_factor) {
  return load_factor * force_n / (face_width_m * module_m * form_factor);
}

ToothReading read_tooth(const SizingTask& task, std::string name, double speed, std::string speed_unit, double force_n,
                        int teeth) {
  ToothReading r{std::move(name), std::move(speed_unit), speed, force_n, barth_factor(speed), 0.0, 0.0};
  r.stress_pa = tooth_stress(r.load_factor, force_n, task.face_width_m, task.module_m, lewis_form_factor(teeth));
  r.safety = task.tooth_strength_pa / r.stress_pa;
  return r;
}

CylinderForces full_cylinder_forces(const SizingTask& task) {
  const double radius = task.gear_diameter_m() / 2, weight = task.vertical ? task.slide_mass_kg * task.gravity : 0.0;
  const auto without_friction = [&](double t) {
    return torque_at(task, t).total_nm() / radius +
           task.slide_mass_kg * radius * arm_at(task.motion, t).acceleration_rad_s2 - weight;
  };
  const auto friction = [&](double t) {
    const double speed = radius * arm_at(task.motion, t).speed_rad_s;
    return task.coulomb_friction_n * ((speed > 0) - (speed < 0)) + task.viscous_friction * speed;
  };
  // On the way back the same accelerations are met in reverse order, and friction with the other sign.
  const auto towards = [&](double direction, double t) { return without_friction(t) + direction * friction(t); };
  CylinderForces forces;
  for (const double way : {1.0, -1.0}) {
    const auto push = [&](double t) { return towards(way, t); };
    const auto pull = [&](double t) { return -towards(way, t); };
    forces.push_n = std::max(forces.push_n, push(argmax(push, task.motion.move_s)));
    forces.pull_n = std::max(forces.pull_n, pull(argmax(pull, task.motion.move_s)));
  }
  return forces;
}

Sizing size_actuator(const SizingTask& task) {
  Sizing s;
  s.acceleration_rad_s2 = largest_acceleration(task.motion);
  s.arm_inertia = arm_inertia(task);
  s.payload_inertia = payload_inertia(task);
  s.acceleration_torque_nm = (s.arm_inertia + s.payload_inertia) * s.acceleration_rad_s2;
  s.peak = torque_peak(task);
  s.torque_nm = s.peak.total_nm();
  s.force_n = force_at_pitch(s.torque_nm, task.gear_diameter_m());
  s.cylinder_n = s.force_n - (task.vertical ? task.slide_mass_kg * task.gravity : 0.0);
  s.bore_m = s.cylinder_n < 0 ? bore_for_force(-s.cylinder_n, task.supply_gauge_pa, task.rod_diameter_m)
                              : bore_for_force(s.cylinder_n, task.supply_gauge_pa);
  s.standard_bore_m = next_standard(task.standard_bores_m, s.bore_m);
  s.motor_nm = motor_torque(task.motor_share, std::abs(s.torque_nm), task.pinion_diameter_m(), task.gear_diameter_m());
  s.speed_rad_s = largest_speed(task.motion);
  s.pitch_speed_m_s = s.speed_rad_s * task.gear_diameter_m() / 2;
  s.gear = read_tooth(task, "gear", s.pitch_speed_m_s, "m/s", std::abs(s.force_n), task.gear_teeth);
  s.pinion = read_tooth(task, "pinion", s.pitch_speed_m_s, "m/s", task.motor_share * s.gear.force_n, task.pinion_teeth);
  s.full = full_cylinder_forces(task);
  s.bore_full_m = std::max(bore_for_force(s.full.push_n, task.supply_gauge_pa),
                           bore_for_force(s.full.pull_n, task.supply_gauge_pa, task.rod_diameter_m));
  s.standard_bore_full_m = next_standard(task.standard_bores_m, s.bore_full_m);
  s.stroke_m = std::abs(task.motion.total_rad) * task.gear_diameter_m() / 2;
  return s;
}

}  // namespace solenoid
