#include "experiments/systems/actuator/twin/twin_plant.hpp"

#include "core/systems/actuator/servo_actuator.hpp"
#include "core/systems/actuator/valves.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {
namespace {

ActuatorState actuator_state(const TwinState& x) { return {x[position], x[velocity], x[pressure_a], x[pressure_b]}; }

/// Independent streams from one seed.
std::uint64_t stream(std::uint64_t seed, std::uint64_t which) {
  std::uint64_t z = seed * 0x9E3779B97F4A7C15u + which * 0xD1B54A32D192ED03u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;  // splitmix64's mixing
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

}  // namespace

TwinParameters twin_for(TwinParameters p, const TwinCase& task) {
  p.actuator = task.mismatch.applied_to(p.actuator);
  p.actuator.payload_mass_kg = task.payload_kg;
  p.actuator.plane = task.plane;
  p.valves.rise_s *= task.mismatch.delay;
  p.valves.fall_s *= task.mismatch.delay;
  return p;
}

TwinPlant::TwinPlant(const TwinParameters& parameters, const std::string& valves, double start_m,
                     const Sensing& sensing)
    : physics_(parameters),
      modes_(valve_modes(valves, parameters.actuator)),
      integrator_(physics_, modes_),
      valves_(modes_, parameters.valves, stream(sensing.seed, 1)),
      state_(physics_.state_at_rest(start_m)),
      sensing_(parameters.sensing, parameters.actuator.atmospheric_pressure_pa, sensing.noise, actuator_state(state_),
               stream(sensing.seed, 2)),
      ideal_(sensing.ideal),
      sound_supply_pa_(parameters.actuator.supply_pressure_pa) {
  if (valves == servo_valves) servo_.emplace(parameters.actuator.servo);
}

ActuatorState TwinPlant::truth() const noexcept { return actuator_state(state_); }

Measurement TwinPlant::read(double time_s) noexcept {
  constexpr double interval = SensingChain::interval_s;
  const auto due = static_cast<std::int64_t>(std::llround(time_s / interval));
  for (; intervals_ < due; ++intervals_) {
    const auto i = static_cast<double>(intervals_);
    if (servo_)
      integrator_.advance(state_, *servo_, motor_command_n_, i * interval, (i + 1) * interval);
    else
      integrator_.advance(state_, valves_, motor_command_n_, i * interval, (i + 1) * interval);
    sensing_.sample(state_[pressure_a], state_[pressure_b]);
  }
  Measurement sensors = sensing_.read(time_s, truth());
  sensors.ideal = ideal_;
  if (servo_) std::ranges::copy(servo_->state(static_cast<double>(intervals_) * interval), &sensors.truth[opening_a]);
  return sensors;
}

void TwinPlant::fail_switch(std::size_t c, const SwitchFault& fault) noexcept {
  valves_.fail(c, fault, static_cast<double>(intervals_) * SensingChain::interval_s);
}

void TwinPlant::fail_part(std::string_view part, std::optional<double> value) noexcept {
  if (part == "chamber_a") physics_.set_leak(0, value.value_or(0.0));
  if (part == "chamber_b") physics_.set_leak(1, value.value_or(0.0));
  if (part != "supply") return;
  const double atmosphere = physics_.parameters().actuator.atmospheric_pressure_pa;
  state_[twin_supply] = atmosphere + value.value_or(1.0) * (sound_supply_pa_ - atmosphere);
  physics_.set_supply(state_[twin_supply]);
}

void TwinPlant::write(const Command& command) noexcept {
  const double now_s = static_cast<double>(intervals_) * SensingChain::interval_s;
  valves_.command(command.switches, now_s);
  if (servo_) servo_->command(command.continuous[opening_a_input], command.continuous[opening_b_input], now_s);
  motor_command_n_ = motor_force_n(command);
}

}  // namespace solenoid
