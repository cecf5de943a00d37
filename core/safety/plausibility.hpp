#pragma once

#include "core/rt/io.hpp"
#include "core/safety/faults.hpp"

#include <array>
#include <limits>
#include <vector>

namespace solenoid {

/// What a channel's values are made of when the quantity rests.
struct ChannelNoise {
  double sigma = 0.0;    ///< of its noise, before the converter
  double quantum = 0.0;  ///< the converter's step, in the channel's unit
  double ticks = 1.0;    ///< the noise's correlation time: values so far apart are independent
};
/// How often a sound sensor may be called stuck by its missing noise: once in so many ticks (30 years at 1 kHz).
inline constexpr double stuck_false_alarm_ticks = 1e12;
/// So many equal values in a row may be told from rest; a sensor that must be watched for longer is not watched so.
inline constexpr int most_stuck_ticks = 2000;

/// How many ticks a channel must show the same value to the bit before it is stuck and not at rest.
///
/// A quantity that rests in the middle of a converter's step, the worst place, shows the same step in a tick with
/// probability
///
///     p = P(|noise| < quantum / 2) = erf(quantum / (sqrt(8) sigma))
///
/// and in n independent ones with p^n: n = ln(1 / stuck_false_alarm_ticks) / ln(p), times the correlation time. Noise
/// without a step (quantum 0) never repeats: 2. Without noise, or with a step much wider than it, rest may look like
/// this for ever: 0, which is SensorBounds' word for "not looked at"; so it is above most_stuck_ticks.
int stuck_ticks_of(const ChannelNoise& noise) noexcept;

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
  double jitter_ticks = 0.5;       ///< a sample may be so early or late: innovations of moving values weigh less
  double innovation_limit = 30.0;  ///< mean squared innovation in variances; a sound sensor's is 1
  double tick_s = 1e-3;            ///< the loop's: by it ages are ticks
};

/// Decides which channels may be believed. A tick whose value is not plausible is left out (the value becomes NaN, which
/// estimators pass over); a channel left out for longer than patience has failed, and stays so until reset.
/// Values need not be of the tick's own instant: one that is younger than the last may have moved for so much longer,
/// one that is older for so much less. No allocation, lock or exception.
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
    double last_good = 0.0, last_raw = 0.0, expected = 0.0, squares = 0.0, suspicion = 0.0, slope = 0.0, age_s = 0.0;
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
  double age_s_ = 0.0;  // of this tick's values
};

}  // namespace solenoid
