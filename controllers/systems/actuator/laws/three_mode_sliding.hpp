#pragma once

#include "controllers/systems/actuator/laws/law.hpp"
#include "controllers/systems/actuator/laws/settings.hpp"

namespace solenoid {

/// Sliding mode by three valve modes on a surface of second order:
///
///     e = y_d - y,    s = e'' / omega^2 + 2 zeta e' / omega + e
///     s >  epsilon    A fills, B exhausts
///     s < -epsilon    B fills, A exhausts
///     else            every valve closed
///
/// On the surface the error dies out as a system of frequency omega and damping zeta whatever the load is. The
/// acceleration in e'' comes from the pressures (believed_acceleration).
///
/// T. Nguyen, J. Leavitt, F. Jabbari, J. E. Bobrow, "Accurate sliding-mode control of pneumatic systems using low-cost
/// solenoid valves", IEEE/ASME Transactions on Mechatronics 12(2), 216-219, 2007. Surface and modes are the paper's as
/// chapter 2 of the thesis and later comparisons give them; the scaling of s is our choice (docs/results/baselines.md).
class ThreeModeSliding {
 public:
  ThreeModeSliding(const SlidingSettings& settings, const ModeSet& modes) : settings_(settings), patterns_(modes) {}

  SwitchPattern coils(const LawInput& in) noexcept {
    if (next_ > in.tick) return last_;
    next_ = in.tick + settings_.every_ticks;
    return last_ = mode(surface(in));
  }
  void restart() noexcept { next_ = 0; }

  double surface(const LawInput& in) const noexcept {
    const double w = settings_.frequency;
    const double acceleration = believed_acceleration(in.model, in.state, in.motor_force_n);
    return (in.desired.acceleration - acceleration) / (w * w) +
           2.0 * settings_.damping / w * (in.desired.rate - in.state[velocity]) +
           (in.desired.value - in.state[position]);
  }
  SwitchPattern mode(double s) const noexcept {
    using enum ChamberAction;
    if (s > settings_.dead_band_m) return patterns_(fill, exhaust);
    if (s < -settings_.dead_band_m) return patterns_(exhaust, fill);
    return patterns_(closed, closed);
  }

 private:
  SlidingSettings settings_;
  ChamberPatterns patterns_;
  SwitchPattern last_ = 0;
  std::int64_t next_ = 0;
};

}  // namespace solenoid
