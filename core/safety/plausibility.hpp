#pragma once

#include "core/rt/io.hpp"
#include "core/safety/faults.hpp"

#include <array>

namespace solenoid {

/// These bounds say what one sensor can show.
struct SensorBounds {
  double low = 0.0, high = 0.0;            ///< what the quantity can be
  double rail_low = 0.0, rail_high = 0.0;  ///< the converter's ends
  double rail_margin = 0.0;                ///< so near an end counts as at it
  double slew_per_tick = 0.0;              ///< the most a sound sensor moves
  double sigma = 1.0;                      ///< of its noise
};

/// The defaults are the thesis's rig: potentiometer on 13 bits over -10..110 mm, pressures behind a 50 Hz Bessel filter
/// on 13 bits over +-210 kPa gauge.
struct PlausibilitySettings {
  SensorBounds position{-0.0095, 0.1095, -0.01, 0.11, 3e-5, 2.5e-3, 3e-5};
  SensorBounds pressure{60e3, 310e3, 101325.0 - 210e3, 101325.0 + 210e3, 1e3, 30e3, 150.0};
  int patience_ticks = 3;          ///< a sensor is left out so long before it counts as failed
  int stale_ticks = 10;            ///< the same for values that did not arrive: half the node's own timeout
  int recovery_ticks = 20;         ///< sound ticks that make up for one that was not
  int stuck_ticks = 100;           ///< position unchanged to the bit so long, against its own noise; 0: not looked at
  double stuck_pa = 25e3;          ///< pressure unchanged to the bit while the model moved it so far; 0: not looked at
  int stuck_lag_ticks = 25;        ///< and so long ago: a filter's delay hides it at first
  double supply_margin_pa = 50e3;  ///< beyond atmosphere and supply, for compression by the slide's own motion
  int supply_ticks = 20;           ///< so long beyond
  int innovation_ticks = 25;       ///< averaging time of the innovations
  double jitter_ticks = 0.5;       ///< a sample may be so early or late: a moving value's innovations weigh less
  double innovation_limit = 30.0;  ///< mean squared innovation in variances; a sound sensor's is 1
};

/// Decides which sensors may be believed. A tick whose value is not plausible is left out (the value becomes NaN, which
/// estimators pass over); a sensor left out for longer than patience has failed, and stays so until reset.
/// No allocation, lock or exception.
class Plausibility {
 public:
  /// What may be believed in a tick, and why the rest may not.
  struct Verdict {
    Sensors sensors;  ///< implausible values replaced by NaN
    FaultSet seen;    ///< in this tick
    FaultSet failed;  ///< why sensors have failed, until reset
    bool sound() const { return seen.empty() && failed.empty(); }
  };

  Plausibility(const PlausibilitySettings& settings, double atmosphere_pa, double supply_pa);

  /// Judges the sensors of a tick, once a tick. `expected_pa_per_tick` is how the model moves the two pressures under
  /// the valves now open; `innovations` are those of the last tick, squared and in variances, from an estimator that
  /// watches, 0 where there is none.
  Verdict check(const Sensors& sensors, const std::array<double, 2>& expected_pa_per_tick,
                const std::array<double, sensor_count>& innovations) noexcept;
  /// Says that ticks have passed without a check: values may have moved meanwhile.
  void skip(int ticks) noexcept;
  /// Forgets everything: sensors start anew.
  void reset() noexcept;

 private:
  struct Channel {
    double last_good = 0.0, last_raw = 0.0, expected_pa = 0.0, squares = 0.0, suspicion = 0.0, slope = 0.0;
    int unchanged = 0, overdue = 0, since_good = 0, beyond_supply = 0;
    bool started = false;
    FaultSet failed;
  };
  /// Adds what is wrong with this value to `seen`; returns whether it may be used.
  bool usable(Sensor sensor, double value, Channel& channel, FaultSet& seen) noexcept;
  bool at_once(Sensor sensor, double value, const Channel& channel, FaultSet& seen) const noexcept;
  bool over_time(Sensor sensor, double value, Channel& channel, FaultSet& seen) noexcept;
  void average(Sensor sensor, double innovation, Channel& channel) const noexcept;
  const SensorBounds& bounds(Sensor sensor) const {
    return sensor == Sensor::position ? settings_.position : settings_.pressure;
  }

  PlausibilitySettings settings_;
  double lowest_pa_, highest_pa_;
  std::array<Channel, sensor_count> channels_;
};

}  // namespace solenoid
