#include "experiments/systems/actuator/simulation/model_sensing.hpp"

#include "core/systems/actuator/signals.hpp"

namespace solenoid {

ModelSensing::ModelSensing(const ModelSensingSettings& s, double tick_s, std::uint64_t seed)
    : settings_(s),
      position_converter_(s.position_low_m, s.position_high_m, s.bits),
      pressure_converter_(s.pressure_low_pa, s.pressure_high_pa, s.bits),
      random_(seed),
      a_{Bessel8(s.filter_hz, substeps / tick_s)},
      b_{Bessel8(s.filter_hz, substeps / tick_s)} {}

void ModelSensing::reset(const ActuatorState& state) {
  position_m_ = state[position];
  for (auto [channel, pressure] : {std::pair{&a_, state[pressure_a]}, std::pair{&b_, state[pressure_b]}}) {
    channel->filter.reset(pressure);
    channel->previous_pa = channel->filtered_pa = pressure;
  }
}

void ModelSensing::advance(const ActuatorState& state) noexcept {
  position_m_ = state[position];
  advance(a_, state[pressure_a]);
  advance(b_, state[pressure_b]);
}

void ModelSensing::advance(Channel& c, double pressure_pa) noexcept {
  double noise = settings_.pressure_input_sigma_pa * normal_(random_);
  if (uniform_(random_) < settings_.spike_probability)
    noise += uniform_(random_) < 0.5 ? settings_.spike_pa : -settings_.spike_pa;
  for (int i = 1; i <= substeps; ++i) {
    const double share = static_cast<double>(i) / substeps;
    c.filtered_pa = c.filter.step(c.previous_pa + share * (pressure_pa - c.previous_pa) + noise);
  }
  c.previous_pa = pressure_pa;
}

void ModelSensing::read(Measurement& s) noexcept {
  s.value[position_channel] = position_converter_(position_m_ + settings_.position_sigma_m * normal_(random_));
  s.value[pressure_a_channel] = pressure_converter_(a_.filtered_pa + settings_.pressure_sigma_pa * normal_(random_));
  s.value[pressure_b_channel] = pressure_converter_(b_.filtered_pa + settings_.pressure_sigma_pa * normal_(random_));
}

}  // namespace solenoid
