#include "experiments/systems/actuator/plants/model_plant.hpp"

#include "controllers/timing.hpp"

#include <cmath>

namespace solenoid {

ModelPlant::ModelPlant(const ActuatorParameters& parameters, const std::string& valves, double start_m,
                       const Sensing& sensing)
    : model_(parameters),
      modes_(valve_modes(valves, parameters)),
      timing_(modes_, tick_s),
      sensing_(sensing),
      chain_({}, tick_s, sensing.seed),
      random_(sensing.seed),
      state_{start_m, 0.0, parameters.atmospheric_pressure_pa, parameters.atmospheric_pressure_pa} {
  chain_.reset(state_);
}

Sensors ModelPlant::read(double time_s) noexcept {
  if (time_s >= push_at_s_) {
    state_[velocity] += push_speed_m_s_;
    push_at_s_ = std::numeric_limits<double>::infinity();
  }
  const auto due = static_cast<std::int64_t>(std::llround(time_s / tick_s));
  while (steps_done_ < due) advance_one_step();
  Sensors s{time_s, state_[position], state_[pressure_a], state_[pressure_b], state_, sensing_.ideal};
  if (sensing_.chain) {
    chain_.read(s);
  } else if (sensing_.noise) {
    s.position_m += sensing_.sigma.position_sigma_m * normal_(random_);
    s.pressure_a_pa += sensing_.sigma.pressure_sigma_pa * normal_(random_);
    s.pressure_b_pa += sensing_.sigma.pressure_sigma_pa * normal_(random_);
  }
  return s;
}

void ModelPlant::write(const Command& command) noexcept {
  lines_.command(command.coils, timing_);
  motor_force_n_ = command.motor_force_n;
}

void ModelPlant::advance_one_step() noexcept {
  SwitchedOf<PneumaticActuator> opening;
  const auto point = modes_.point(lines_.effective());
  std::copy(point.begin(), point.end(), opening.begin());
  air_kg_ += model_.consumption<double>(state_, opening) * tick_s;
  state_ = model_.step<double>(state_, opening, {motor_force_n_}, tick_s);
  if (sensing_.chain) chain_.advance(state_);
  lines_.advance(1);
  ++steps_done_;
}

}  // namespace solenoid
