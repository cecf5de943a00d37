#pragma once

#include "core/signal/bessel.hpp"
#include "core/signal/filters.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/systems/actuator/twin/twin_parameters.hpp"

#include <random>

namespace solenoid {

/// From the plant's state to the converter's numbers (model.md, section 6).
///
/// pressures   truth + white noise + spikes, each 0.1 ms -> Bessel filter -> 13-bit converter at the tick
/// position    truth + white noise -> 13-bit converter at the tick (the controller's program filters it)
class SensingChain {
 public:
  static constexpr double interval_s = 1e-4;

  /// Filters settled at the state; without noise there are neither noise nor spikes, but filters and converter stay.
  SensingChain(const SensingEffects& effects, double atmosphere_pa, bool noise, const ActuatorState& state,
               std::uint64_t seed);

  /// One raw sample of both pressures, every interval_s.
  void sample(double pressure_a_pa, double pressure_b_pa) noexcept;
  /// What the converter gives now.
  Measurement read(double time_s, const ActuatorState& truth) noexcept;

 private:
  struct Channel {
    Bessel8 filter;
    double filtered_pa = 0;
    double spike_pa = 0;
    int spike_left = 0;  ///< intervals
  };
  void sample(Channel& channel, double pressure_pa) noexcept;
  double converted(const Quantiser& converter, double value) const noexcept;

  SensingEffects effects_;
  bool noise_;
  int spike_intervals_;
  Channel a_, b_;
  Quantiser position_converter_, pressure_converter_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
};

}  // namespace solenoid
