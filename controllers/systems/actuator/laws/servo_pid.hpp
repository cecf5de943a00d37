#pragma once

#include "controllers/systems/actuator/laws/law.hpp"
#include "controllers/systems/actuator/laws/settings.hpp"
#include "controllers/systems/actuator/servo_inputs.hpp"
#include "core/systems/actuator/signals.hpp"

#include <algorithm>

namespace solenoid {

/// Position control by servo valves as it is sold: PID with bounded integral, velocity feedforward and acceleration
/// feedback, which damps what the air's spring and the load would do.
///
///     e = y_d - y
///     I <- clamp(I + K_i e T, -I_max, I_max),    held while u is beyond its bounds and e would take it further
///     u = clamp(K_v v_d + K_p e + K_d (v_d - v) + K_a (a_d - a) + I, -1, 1)
///     opening of A = u, of B = -u;    what is commanded makes up for the overlap (ServoInputs)
///
/// The acceleration comes from the pressures (believed_acceleration): with them its feedback is that of the pressure
/// difference. State feedback of position, velocity and acceleration is what commercial servo-pneumatic axis
/// controllers have; cf. P. Beater, Pneumatic Drives, Springer 2007; X. Brun et al., "A comparative study
/// between two control laws of an electropneumatic actuator", European Control Conference 1999.
class ServoPid {
 public:
  ServoPid(const ServoPidSettings& settings, const ServoSettings& valves, double tick_s)
      : settings_(settings), inputs_(MotorInputs(), valves, false), tick_s_(tick_s) {}

  Command command(const LawInput& in) noexcept {
    const double u = opening(in);
    const Vector<double, 3> sent = inputs_.commanded({in.motor_force_n, u, -u});
    return {0, padded<max_continuous>(sent)};
  }
  void restart() noexcept { integral_ = 0.0; }

  /// u of this tick, the integral moved on by it.
  double opening(const LawInput& in) noexcept {
    const ServoPidSettings& s = settings_;
    const double error = in.desired.value - in.state[position];
    const double acceleration = believed_acceleration(in.model, in.state, in.motor_force_n);
    const double without = s.feedforward * in.desired.rate + s.proportional * error +
                           s.derivative * (in.desired.rate - in.state[velocity]) +
                           s.acceleration * (in.desired.acceleration - acceleration);
    const double u = without + integral_;
    if ((u < 1.0 || error < 0.0) && (u > -1.0 || error > 0.0))
      integral_ = std::clamp(integral_ + s.integral * error * tick_s_, -s.integral_limit, s.integral_limit);
    return std::clamp(without + integral_, -1.0, 1.0);
  }
  double integral() const { return integral_; }

 private:
  ServoPidSettings settings_;
  ServoInputs inputs_;
  double tick_s_;
  double integral_ = 0.0;
};

}  // namespace solenoid
