#pragma once

#include "core/systems/actuator/servo_valve.hpp"
#include "experiments/systems/actuator/twin/twin_physics.hpp"

namespace solenoid {

/// Openings of the servo valves in continuous time: between commands a spool's motion is known in closed form
/// (servo_valve.hpp), so that nothing of it is integrated.
class ServoActuation {
 public:
  /// Spools at rest at null.
  explicit ServoActuation(const ServoValve& valve) : valve_(valve) {}

  /// Commands both valves at `time_s`, which never decreases.
  void command(double command_a, double command_b, double time_s) noexcept;
  /// Openings at `time_s`, not before the last command.
  Openings openings(double time_s) const noexcept;
  /// Signed opening and rate of A, then of B.
  std::array<double, 4> state(double time_s) const noexcept;

 private:
  std::array<Spool, 2> at(double time_s) const noexcept;

  ServoValve valve_;
  std::array<Spool, 2> spools_{};  // at since_s_
  double since_s_ = 0.0;
};

}  // namespace solenoid
