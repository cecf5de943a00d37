#pragma once

#include "controllers/systems/actuator/laws/law.hpp"

namespace solenoid::test {

/// A law's surroundings: a horizontal slide without friction at rest, no pressure force, and a reference that can move.
struct LawScene {
  LawScene() {
    ActuatorParameters p;
    p.plane = Plane::horizontal;
    p.static_friction_n = p.coulomb_friction_n = p.viscous_friction = 0.0;
    model = PneumaticActuator(p);
  }
  LawInput at(std::int64_t tick) const {
    const double time_s = 1e-3 * static_cast<double>(tick);
    return {tick, time_s, reference, reference.at(time_s).axis[0], state, motor_n, model};
  }
  PneumaticActuator model;
  RestartableReference reference{Trajectory(0.05)};
  ActuatorState state{0.05, 0.0, 101325.0, 101325.0};
  double motor_n = 0.0;
};

}  // namespace solenoid::test
