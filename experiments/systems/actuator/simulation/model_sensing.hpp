#pragma once

#include "core/signal/bessel.hpp"
#include "core/signal/filters.hpp"
#include "core/systems/actuator/signals.hpp"

#include <random>

namespace solenoid {

/// The rig's sensors (model.md, section 6): an unfiltered potentiometer; pressures with noise and spikes before the
/// eighth-order Bessel filter, a little noise after it; both through a converter.
struct ModelSensingSettings {
  double position_sigma_m = 0.03e-3;
  double position_low_m = -0.01, position_high_m = 0.11;  ///< the potentiometer's range
  double filter_hz = 50.0;
  double pressure_input_sigma_pa = 500.0;             ///< white, held for a tick, before the filter
  double spike_pa = 10e3, spike_probability = 0.005;  ///< a tick long, of either sign
  double pressure_sigma_pa = 50.0;                    ///< white, after the filter
  double pressure_low_pa = 101325.0 - 210e3, pressure_high_pa = 101325.0 + 210e3;
  int bits = 13;  ///< of both converters
};

/// True states in, one a tick; sensors out. The filter runs at ten times the tick, its input moving linearly within it.
class ModelSensing {
 public:
  ModelSensing(const ModelSensingSettings& settings, double tick_s, std::uint64_t seed);
  /// Starts settled at `state`.
  void reset(const ActuatorState& state);
  /// The true state a tick after the last.
  void advance(const ActuatorState& state) noexcept;
  /// Fills the measured fields.
  void read(Measurement& sensors) noexcept;

 private:
  static constexpr int substeps = 10;
  struct Channel {
    Bessel8 filter;
    double previous_pa = 0.0, filtered_pa = 0.0;
  };
  void advance(Channel& channel, double pressure_pa) noexcept;

  ModelSensingSettings settings_;
  Quantiser position_converter_, pressure_converter_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
  Channel a_, b_;
  double position_m_ = 0.0;
};

}  // namespace solenoid
