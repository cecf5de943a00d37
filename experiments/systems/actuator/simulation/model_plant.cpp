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

void ModelPlant::advance_one_step() noexcept {
  SwitchedOf<PneumaticActuator> opening;
  const auto point = modes_.point(lines_.effective());
  std::copy(point.begin(), point.end(), opening.begin());
  if (servo_) {
    opening = servo_->openings(continuous_[opening_a_input], continuous_[opening_b_input]);
    servo_->advance();
  }
  air_kg_ += model_.consumption<double>(state_, opening) * tick_s_;
  state_ = model_.step<double>(state_, opening, {motor_force_n_}, tick_s_);
  if (sensing_.chain) chain_.advance(state_);
  lines_.advance(1);
  ++steps_done_;
}

}  // namespace solenoid
