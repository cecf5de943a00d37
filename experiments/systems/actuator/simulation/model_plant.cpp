#include "experiments/systems/actuator/simulation/model_plant.hpp"

#include "core/systems/actuator/servo_actuator.hpp"
#include "core/systems/actuator/signals.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {

ModelPlant::ModelPlant(const ActuatorParameters& parameters, const std::string& valves, double start_m,
                       const Sensing& sensing, double tick_s)
    : model_(parameters),
      modes_(valve_modes(valves, parameters)),
      timing_(modes_, tick_s),
      sensing_(sensing),
      chain_({}, tick_s, sensing.seed),
      random_(sensing.seed),
      state_{start_m, 0.0, parameters.atmospheric_pressure_pa, parameters.atmospheric_pressure_pa},
      sound_supply_pa_(parameters.supply_pressure_pa),
      tick_s_(tick_s) {
  if (valves == servo_valves) servo_.emplace(parameters.servo, tick_s);
  chain_.reset(state_);
}

Measurement ModelPlant::read(double time_s) noexcept {
  if (time_s >= push_at_s_) {
    state_[velocity] += push_speed_m_s_;
    push_at_s_ = std::numeric_limits<double>::infinity();
  }
  const auto due = static_cast<std::int64_t>(std::llround(time_s / tick_s_));
  while (steps_done_ < due) advance_one_step();
  Measurement s{
      time_s, {state_[position], state_[pressure_a], state_[pressure_b]}, padded<max_states>(state_), sensing_.ideal};
  if (servo_) std::ranges::copy(servo_->state(), &s.truth[opening_a]);
  if (sensing_.chain) {
    chain_.read(s);
  } else if (sensing_.noise) {
    s.value[position_channel] += sensing_.sigma.position_sigma_m * normal_(random_);
    s.value[pressure_a_channel] += sensing_.sigma.pressure_sigma_pa * normal_(random_);
    s.value[pressure_b_channel] += sensing_.sigma.pressure_sigma_pa * normal_(random_);
  }
  return s;
}

void ModelPlant::write(const Command& command) noexcept {
  lines_.command(command.switches, timing_);
  continuous_ = command.continuous;
  motor_force_n_ = motor_force_n(command);
}

void ModelPlant::fail_switch(std::size_t c, const SwitchFault& fault) noexcept {
  if (c >= static_cast<std::size_t>(timing_.switches)) return;
  faults_[c] = fault;
  const auto later = [&](double delay_s) {
    const double late_s = fault.kind == SwitchFaultKind::slow ? fault.value : 0.0;
    return static_cast<int>(std::min<double>(std::round((delay_s + late_s) / tick_s_), max_delay_steps));
  };
  timing_.rise[c] = later(modes_.switches()[c].rise_delay_s);
  timing_.fall[c] = later(modes_.switches()[c].fall_delay_s);
}

void ModelPlant::fail_part(std::string_view part, std::optional<double> value) noexcept {
  if (part == "chamber_a") leak_[0] = value.value_or(0.0);
  if (part == "chamber_b") leak_[1] = value.value_or(0.0);
  if (part != "supply") return;
  ActuatorParameters p = model_.parameters();
  p.supply_pressure_pa =
      p.atmospheric_pressure_pa + value.value_or(1.0) * (sound_supply_pa_ - p.atmospheric_pressure_pa);
  const auto load = model_.load();
  model_ = PneumaticActuator(p);
  model_.set_load(load);
}

/// Openings with what coils that have failed add to those of the pattern, or take away.
SwitchedOf<PneumaticActuator> ModelPlant::openings() const noexcept {
  const SwitchPattern pattern = lines_.effective();
  SwitchedOf<PneumaticActuator> opening;
  std::ranges::copy(modes_.point(pattern), opening.begin());
  for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c) {
    if (faults_[c].kind == SwitchFaultKind::none) continue;
    const double sound = ((pattern >> c) & 1u) != 0 ? 1.0 : 0.0, changed = faults_[c].opening(sound) - sound;
    for (std::size_t i = 0; i < opening.size(); ++i) opening[i] += changed * modes_.gain(c)[i];
  }
  return opening;
}

void ModelPlant::advance_one_step() noexcept {
  SwitchedOf<PneumaticActuator> opening = openings();
  if (servo_) {
    opening = servo_->openings(continuous_[opening_a_input], continuous_[opening_b_input]);
    servo_->advance();
  }
  opening[exhaust_a] += leak_[0];
  opening[exhaust_b] += leak_[1];
  air_kg_ += model_.consumption<double>(state_, opening) * tick_s_;
  state_ = model_.step<double>(state_, opening, {motor_force_n_}, tick_s_);
  if (sensing_.chain) chain_.advance(state_);
  lines_.advance(1);
  ++steps_done_;
}

}  // namespace solenoid
