#pragma once

#include "core/rt/io.hpp"
#include "core/safety/faults.hpp"

#include <array>
#include <limits>
#include <vector>

namespace solenoid {

/// These bounds say what one channel can show.
struct SensorBounds {
  double low = 0.0, high = 0.0;            ///< what the quantity can be
  double rail_low = 0.0, rail_high = 0.0;  ///< the converter's ends
  double rail_margin = 0.0;                ///< so near an end counts as at it
  double slew_per_tick = 0.0;              ///< the most a sound sensor moves
  double sigma = 1.0;                      ///< of its noise
  int stuck_ticks = 0;                     ///< unchanged to the bit so long, against its own noise; 0: not looked at
  double stuck_change = 0.0;               ///< unchanged to the bit while the model moved it so far; 0: not looked at
  double supply_low = -std::numeric_limits<double>::infinity();  ///< what the plant's supply can bring about
  double supply_high = std::numeric_limits<double>::infinity();
};

/// What is believed of a system's channels, in the order of its description.
struct PlausibilitySettings {
  std::vector<SensorBounds> channels;
  int patience_ticks = 3;          ///< a channel is left out so long before it counts as failed
  int stale_ticks = 10;            ///< the same for values that did not arrive: half the node's own timeout
  int recovery_ticks = 20;         ///< sound ticks that make up for one that was not
  int stuck_lag_ticks = 25;        ///< so long ago the model's change must be: a filter's delay hides it at first
  int supply_ticks = 20;           ///< so long beyond the supply
  int innovation_ticks = 25;       ///< averaging time of the innovations
  double jitter_ticks = 0.5;       ///< a sample may be so early or late: a moving value's innovations weigh less
  double innovation_limit = 30.0;  ///< mean squared innovation in variances; a sound sensor's is 1
};

/// Decides which channels may be believed. A tick whose value is not plausible is left out (the value becomes NaN, which
/// estimators pass over); a channel left out for longer than patience has failed, and stays so until reset.
/// No allocation, lock or exception.
class Plausibility {
 public:
  /// What may be believed in a tick, and why the rest may not.
  struct Verdict {
    Measurement measured;  ///< implausible values replaced by NaN
    FaultSet seen;         ///< in this tick
    FaultSet failed;       ///< why channels have failed, until reset
    bool sound() const { return seen.empty() && failed.empty(); }
  };

  explicit Plausibility(const PlausibilitySettings& settings);

  /// Judges the channels of a tick, once a tick. `expected_per_tick` is how the model moves each under the inputs now in
  /// effect; `innovations` are those of the last tick, squared and in variances, from an estimator that watches, 0 where
  /// there is none.
  Verdict check(const Measurement& measured, const ChannelValues& expected_per_tick,
                const ChannelValues& innovations) noexcept;
  /// Says that ticks have passed without a check: values may have moved meanwhile.
  void skip(int ticks) noexcept;
  /// Forgets everything: channels start anew.
  void reset() noexcept;

 private:
  struct Channel {
    double last_good = 0.0, last_raw = 0.0, expected = 0.0, squares = 0.0, suspicion = 0.0, slope = 0.0;
    int unchanged = 0, overdue = 0, since_good = 0, beyond_supply = 0;
    bool started = false;
    FaultSet failed;
  };
  /// Adds what is wrong with this value to `seen`; returns whether it may be used.
  bool usable(std::size_t channel, double value, FaultSet& seen) noexcept;
  bool at_once(std::size_t channel, double value, FaultSet& seen) const noexcept;
  bool over_time(std::size_t channel, double value, FaultSet& seen) noexcept;
  void average(std::size_t channel, double innovation) noexcept;

  PlausibilitySettings settings_;
  std::array<Channel, max_channels> channels_;
};

}  // namespace solenoid
