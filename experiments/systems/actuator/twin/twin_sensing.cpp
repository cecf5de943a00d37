#include "experiments/systems/actuator/twin/twin_sensing.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {
namespace {

/// A cut-off for the filter object when there is no filter.
double cutoff(const SensingEffects& e) { return e.bessel_hz > 0 ? e.bessel_hz : 50.0; }

}  // namespace

SensingChain::SensingChain(const SensingEffects& e, double atmosphere_pa, bool noise, const ActuatorState& state,
                           std::uint64_t seed)
    : effects_(e),
      noise_(noise),
      spike_intervals_(std::max(1, static_cast<int>(std::lround(e.spike_duration_s / interval_s)))),
      a_{Bessel8(cutoff(e), 1 / interval_s), state[pressure_a]},
      b_{Bessel8(cutoff(e), 1 / interval_s), state[pressure_b]},
      position_converter_(e.position_low_m, e.position_high_m, std::max(1, e.converter_bits)),
      pressure_converter_(atmosphere_pa - e.pressure_span_pa, atmosphere_pa + e.pressure_span_pa,
                          std::max(1, e.converter_bits)),
      random_(seed) {
  a_.filter.reset(state[pressure_a]);
  b_.filter.reset(state[pressure_b]);
}

void SensingChain::sample(double pressure_a_pa, double pressure_b_pa) noexcept {
  sample(a_, pressure_a_pa);
  sample(b_, pressure_b_pa);
}

void SensingChain::sample(Channel& channel, double pressure_pa) noexcept {
  double raw = pressure_pa;
  if (noise_) {
    raw += effects_.pressure_sigma_pa * normal_(random_);
    if (channel.spike_left > 0)
      --channel.spike_left;
    else if (uniform_(random_) < effects_.spike_rate_hz * interval_s) {
      channel.spike_left = spike_intervals_ - 1;
      channel.spike_pa = uniform_(random_) < 0.5 ? -effects_.spike_pa : effects_.spike_pa;
    } else {
      channel.spike_pa = 0;
    }
    raw += channel.spike_pa;
  }
  channel.filtered_pa = effects_.bessel_hz > 0 ? channel.filter.step(raw) : raw;
}

double SensingChain::converted(const Quantiser& converter, double value) const noexcept {
  return effects_.converter_bits > 0 ? converter(value) : value;
}

Measurement SensingChain::read(double time_s, const ActuatorState& truth) noexcept {
  const double wiper = truth[position] + (noise_ ? effects_.position_sigma_m * normal_(random_) : 0.0);
  return {.time_s = time_s,
          .value = {converted(position_converter_, wiper), converted(pressure_converter_, a_.filtered_pa),
                    converted(pressure_converter_, b_.filtered_pa)},
          .truth = padded<max_states>(truth)};
}

}  // namespace solenoid
