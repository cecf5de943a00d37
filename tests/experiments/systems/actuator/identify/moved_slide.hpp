#pragma once

#include "core/systems/actuator/residual_actuator.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/systems/actuator/identify/record.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace solenoid::test {

/// A record of a slide on the bench with `residual` beside `believed`, moved to and fro by the motor; both chambers are
/// open to the air.
inline Record moved_slide(const ActuatorParameters& believed, const ForceResidual& residual, double noise_m) {
  Record r;
  r.name = "moved";
  r.plane = believed.plane;
  const ResidualActuator plant(believed, {0.0, 0.0}, residual);
  const ModeSet modes = valve_modes("two_way", believed);
  const Vector<double, 4> open = {0, 1, 0, 1};
  SwitchPattern pattern = 0;
  for (int mode = 0; mode < modes.size(); ++mode)
    if (std::ranges::equal(modes.point(modes.pattern(mode)), open)) pattern = modes.pattern(mode);
  ActuatorState x = {0.05, 0.0, 101325.0, 101325.0};
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, noise_m);
  for (int k = 0; k < 12000; ++k) {
    const double t = 0.001 * k, wanted = 0.05 + 0.012 * std::sin(4.0 * t) + 0.015 * std::sin(1.3 * t);
    const double speed = 0.048 * std::cos(4.0 * t) + 0.0195 * std::cos(1.3 * t);
    const double motor_n = std::clamp(4000.0 * (wanted - x[position]) + 300.0 * (speed - x[velocity]), -8.0, 8.0);
    r.position_m.push_back(x[position] + noise(random));
    r.pressure_a_pa.push_back(x[pressure_a]);
    r.pressure_b_pa.push_back(x[pressure_b]);
    r.motor_n.push_back(motor_n);
    r.coils.push_back(pattern);
    x = plant.step<double>(x, open, {motor_n}, 0.001);
  }
  return r;
}

}  // namespace solenoid::test
