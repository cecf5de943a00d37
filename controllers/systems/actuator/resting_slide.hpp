#pragma once

#include "core/systems/actuator/dynamics.hpp"

namespace solenoid {

/// How far a slide must have moved since its position last changed, whatever load it carries: what tells a stuck
/// potentiometer from a slide that rests. It reads forces alone, so a stuck position cannot fool it as it fools an
/// estimator, which explains it by a load.
///
///     drive  F = cylinder's force + motor's          load L: gravity, payload, disturbance; unknown, constant at rest
///     rest   |F + L| <= F_sf at every instant, so     F - min F <= 2 F_sf   and   max F - F <= 2 F_sf
///
/// with extremes since the position last changed. What the drive has beyond that moves even the slide of the greatest
/// load; friction may be twice the model's:
///
///     m_most dv/dt = F - min F - 4 F_sf  or  F - max F + 4 F_sf,  0 between them, where v returns to 0
///
/// Within a millimetre of an end stop it says nothing: a stop holds any force. It is the stop that the sensor shows, so
/// one stuck there is left to the innovations; and no run stays there: the ladder's limits on the position, beyond
/// which it is SAFE, lie 1.5 mm and 12 mm inside the stops (actuator_ladder).
/// promise   no allocation, lock or exception
class RestingSlide {
 public:
  static constexpr double most_payload_kg = 0.3;  ///< twice the greatest that the thesis moves
  static constexpr double friction_factor_most = 2.0;
  static constexpr double stop_margin_m = 1e-3;

  RestingSlide(const PneumaticActuator& model, double tick_s);

  /// Takes a tick's position (NaN: none came) and the pressures and motor force that act.
  void advance(double measured_m, double pressure_a_pa, double pressure_b_pa, double motor_n) noexcept;
  /// How far it must have moved in the tick taken last [m], with its sign.
  double moved_m() const { return velocity_ * tick_s_; }

 private:
  PneumaticActuator model_;
  double tick_s_, inverse_mass_, band_n_;
  double position_m_, least_n_ = 0.0, most_n_ = 0.0, velocity_ = 0.0;
};

}  // namespace solenoid
