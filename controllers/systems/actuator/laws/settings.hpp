#pragma once

#include <string>

namespace solenoid {

/// Gains of PulseWidthPid; duties are of full scale, -1 to 1.
struct PulseWidthSettings {
  double proportional = 10.0;   ///< [1/m]
  double integral = 20.0;       ///< [1/(m s)]
  double derivative = 0.5;      ///< [s/m]
  double integral_limit = 0.3;  ///< bound of the integral's share
  double feedforward = 0.0;     ///< of the desired position's coming change over `lead_s` [1/m]
  double lead_s = 0.05;
  double friction = 0.0;          ///< share against Coulomb friction
  double friction_band_m = 1e-4;  ///< at rest: smaller errors are left alone
  double bias = 0.5;              ///< duty of both valves at u = 0
  int period_ticks = 16;          ///< of 1 ms, of the pulses and of the law
  bool operator==(const PulseWidthSettings&) const = default;
};

/// Of ThreeModeSliding.
struct SlidingSettings {
  double frequency = 60.0;    ///< omega of the surface [rad/s]
  double damping = 1.0;       ///< zeta
  double dead_band_m = 1e-4;  ///< epsilon
  int every_ticks = 5;        ///< of 1 ms, between decisions
  bool operator==(const SlidingSettings&) const = default;
};

/// Of SevenModeSliding, beside those of the surface.
struct SevenModeSettings {
  double full_above_m = 3e-4;       ///< beta: where both chambers act
  double mean_pressure_pa = 1.2e5;  ///< p_m, absolute: filled up to, exhausted down to
  bool operator==(const SevenModeSettings&) const = default;
};

/// Of EndPosition.
struct EndPositionSettings {
  double lead_s = 0.0;           ///< of the target before the desired position
  double start_m = 5e-4;         ///< a larger error starts the slide
  double stop_m = 1e-4;          ///< before the target at which valves close
  double anticipation_s = 0.08;  ///< of the way at the present speed, added to that
  double cushion_m = 1e-3;       ///< before the target in which nothing exhausts
  double exhaust_share = 0.4;    ///< of the time, in which the exhaust is open
  int period_ticks = 10;         ///< of the exhaust's pulses
  bool operator==(const EndPositionSettings&) const = default;
};

/// Gains of ServoPid; openings are of full scale, -1 to 1.
struct ServoPidSettings {
  double proportional = 700.0;  ///< [1/m]
  double integral = 3500.0;     ///< [1/(m s)]
  double integral_limit = 0.1;  ///< bound of the integral's share
  double derivative = 55.0;     ///< [s/m]
  double acceleration = 1.4;    ///< [s2/m]
  double feedforward = 2.0;     ///< of the desired velocity [s/m]
  bool operator==(const ServoPidSettings&) const = default;
};

/// Of SwitchingHybrid.
struct PhaseSettings {
  double coarse_above_m = 3e-4;  ///< a larger error takes the cylinder in
  double fine_below_m = 1e-4;    ///< a smaller one leaves it to the motor; at most coarse_above_m
  std::string rest = "closed";   ///< in the fine phase; "exhaust": both chambers open to the air
  bool operator==(const PhaseSettings&) const = default;
};

}  // namespace solenoid
