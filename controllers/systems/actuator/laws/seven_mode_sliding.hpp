#pragma once

#include "controllers/systems/actuator/laws/three_mode_sliding.hpp"

#include <cmath>

namespace solenoid {

/// Sliding mode by seven valve modes on the surface of ThreeModeSliding: no more drive than the surface asks for.
///
///     |s| <= epsilon            every valve closed
///     epsilon < |s| <= beta     one chamber acts, the other is closed
///     beta < |s|                both act: one fills, the other exhausts
///
/// In between the chamber that pushes fills where the mean pressure of both is below p_m, and else the other exhausts:
/// so of the two modes that push the same way none is used up, and the pressures stay where the valves have flow.
///
/// S. Hodgson, M. Q. Le, M. Tavakoli, M. T. Pham, "Improved tracking and switching performance of an electro-pneumatic
/// positioning system", Mechatronics 22 (2012) 1-12; S. Hodgson, M. Tavakoli, M. T. Pham, A. Leleve, "Nonlinear
/// discontinuous dynamics averaging and PWM-based sliding control of solenoid-valve pneumatic actuators", IEEE/ASME
/// Transactions on Mechatronics 20(2) (2015) 876-888. The seven modes and the bands of |s| are the papers'; which of
/// the two modes is taken in the middle band by the mean pressure, and the scaling of s, are our reading.
class SevenModeSliding {
 public:
  SevenModeSliding(const SlidingSettings& settings, const SevenModeSettings& bands, const ModeSet& modes)
      : settings_(settings), bands_(bands), surface_(settings, modes), patterns_(modes) {}

  SwitchPattern coils(const LawInput& in) noexcept {
    if (next_ > in.tick) return last_;
    next_ = in.tick + settings_.every_ticks;
    return last_ = mode(surface_.surface(in), 0.5 * (in.state[pressure_a] + in.state[pressure_b]));
  }
  void restart() noexcept { next_ = 0; }

  /// At a mean pressure [Pa].
  SwitchPattern mode(double s, double mean_pressure_pa) const noexcept {
    using enum ChamberAction;
    if (std::abs(s) <= settings_.dead_band_m) return patterns_(closed, closed);
    if (std::abs(s) > bands_.full_above_m) return surface_.mode(s);
    const bool fills = mean_pressure_pa < bands_.mean_pressure_pa;
    if (s > 0.0) return fills ? patterns_(fill, closed) : patterns_(closed, exhaust);
    return fills ? patterns_(closed, fill) : patterns_(exhaust, closed);
  }

 private:
  SlidingSettings settings_;
  SevenModeSettings bands_;
  ThreeModeSliding surface_;
  ChamberPatterns patterns_;
  SwitchPattern last_ = 0;
  std::int64_t next_ = 0;
};

}  // namespace solenoid
