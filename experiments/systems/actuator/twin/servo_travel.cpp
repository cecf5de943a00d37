#include "experiments/systems/actuator/twin/servo_travel.hpp"

namespace solenoid {

std::array<Spool, 2> ServoActuation::at(double time_s) const noexcept {
  const SpoolStep step(valve_, time_s - since_s_);
  return {spools_[0].after(step), spools_[1].after(step)};
}

void ServoActuation::command(double command_a, double command_b, double time_s) noexcept {
  spools_ = at(time_s);
  since_s_ = time_s;
  spools_[0].command(valve_, command_a);
  spools_[1].command(valve_, command_b);
}

Openings ServoActuation::openings(double time_s) const noexcept {
  const auto [a, b] = at(time_s);
  return {valve_.opening(a.x), valve_.opening(-a.x), valve_.opening(b.x), valve_.opening(-b.x)};
}

std::array<double, 4> ServoActuation::state(double time_s) const noexcept {
  const auto [a, b] = at(time_s);
  const auto of_a = signed_opening(valve_, a), of_b = signed_opening(valve_, b);
  return {of_a[0], of_a[1], of_b[0], of_b[1]};
}

}  // namespace solenoid
