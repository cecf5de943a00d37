#include "controllers/systems/actuator/resting_slide.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace solenoid {

RestingSlide::RestingSlide(const PneumaticActuator& model, double tick_s)
    : model_(model),
      tick_s_(tick_s),
      inverse_mass_(model.conditions<double>(most_payload_kg, 0.0, 1.0).inverse_mass),
      band_n_(2.0 * friction_factor_most * model.parameters().static_friction_n),
      position_m_(std::numeric_limits<double>::quiet_NaN()) {}

void RestingSlide::advance(double measured_m, double pressure_a_pa, double pressure_b_pa, double motor_n) noexcept {
  const double drive = model_.cylinder_force(pressure_a_pa, pressure_b_pa) + model_.saturated_motor_force(motor_n);
  const ActuatorParameters& p = model_.parameters();
  const bool changed = std::isfinite(measured_m) && measured_m != position_m_;
  if (changed) position_m_ = measured_m;
  const bool free =
      position_m_ > p.position_min_m() + stop_margin_m && position_m_ < p.position_max_m() - stop_margin_m;
  if (changed || !free || !std::isfinite(drive)) {
    least_n_ = most_n_ = std::isfinite(drive) ? drive : 0.0;
    velocity_ = 0.0;
    return;
  }
  least_n_ = std::min(least_n_, drive);
  most_n_ = std::max(most_n_, drive);
  const double up = drive - least_n_ - band_n_, down = drive - most_n_ + band_n_;
  if (up > 0)
    velocity_ = std::max(0.0, velocity_) + tick_s_ * inverse_mass_ * up;
  else if (down < 0)
    velocity_ = std::min(0.0, velocity_) + tick_s_ * inverse_mass_ * down;
  else
    velocity_ = 0.0;
}

}  // namespace solenoid
