#include "controllers/systems/actuator/actuator_guard.hpp"

#include "core/systems/actuator/signals.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {
namespace {

EstimatorTuning watching(double tick_s) {
  EstimatorTuning tuning;
  tuning.tick_s = tick_s;
  return tuning;
}

SwitchedOf<PneumaticActuator> openings(std::span<const double> point) {
  SwitchedOf<PneumaticActuator> opening{};
  std::ranges::copy(point, opening.begin());
  return opening;
}

}  // namespace

ActuatorGuard::ActuatorGuard(const PneumaticActuator& model, const ModeSet& modes, std::optional<MotorGains> motor,
                             double tick_s, std::optional<ServoPair> servo, const std::vector<SpareModes>& spares)
    : model_(model),
      tick_s_(tick_s),
      candidates_(model, modes, tick_s),
      watch_(model, watching(tick_s)),
      new_watch_(watch_),
      slide_(model, tick_s),
      new_slide_(slide_),
      servo_(servo) {
  if (motor) motor_.emplace(model, *motor);
  spare_candidates_.reserve(spares.size());
  for (const SpareModes& spare : spares) {
    spare_of_.push_back(spare.left ? spare_candidates_.size() : none);
    if (spare.left) spare_candidates_.emplace_back(model, *spare.left, tick_s);
  }
}

StateValues ActuatorGuard::watch(const Measurement& believed) noexcept {
  if (servo_) servo_->advance();
  const ActuatorState state = watch_.update(believed);
  slide_.advance(believed.value[position_channel], state[pressure_a], state[pressure_b], motor_n_);
  return padded<max_states>(state);
}

/// The servo valves went on meanwhile.
void ActuatorGuard::reset() noexcept {
  watch_ = new_watch_;
  slide_ = new_slide_;
}

void ActuatorGuard::applied(std::span<const double> opening, const ContinuousValues& continuous) noexcept {
  opening_ = servo_ ? servo_->openings(continuous[opening_a_input], continuous[opening_b_input]) : openings(opening);
  motor_n_ = continuous[motor_input];
  watch_.applied(opening_, motor_n_);
}

void ActuatorGuard::use(std::size_t k) noexcept {
  if (k < spare_of_.size() && spare_of_[k] != none) in_use_ = &spare_candidates_[spare_of_[k]];
}

ChannelValues ActuatorGuard::innovations() const noexcept { return padded<max_channels>(watch_.innovations()); }

ChannelValues ActuatorGuard::expected_change(const StateValues& state, std::span<const double> opening) const noexcept {
  ActuatorState x = model_.nearest_valid(actuator_state(state));
  x[velocity] = 0.0;
  const ActuatorState next = model_.step<double>(x, servo_ ? opening_ : openings(opening), {0.0}, tick_s_);
  ChannelValues change{};
  change[position_channel] = slide_.moved_m();
  change[pressure_a_channel] = next[pressure_a] - x[pressure_a];
  change[pressure_b_channel] = next[pressure_b] - x[pressure_b];
  return change;
}

bool ActuatorGuard::at_rest(const StateValues& state) const noexcept {
  return std::abs(state[velocity]) <= rest_speed_m_s;
}

SwitchPattern ActuatorGuard::held_mode(const StateValues& state, const DelayLines& lines,
                                       const RestartableReference& reference, double time_s) noexcept {
  return in_use_->search(actuator_state(state), lines, reference, time_s);
}

ContinuousValues ActuatorGuard::held_inputs(const ContinuousValues& decided) const noexcept {
  return servo_ ? ContinuousValues{decided[motor_input]} : decided;
}

ContinuousValues ActuatorGuard::backup_law(const ReferenceSample& desired, const StateValues& state) const noexcept {
  return {motor_ ? motor_->force(desired.axis[0], actuator_state(state)) : 0.0};
}

ContinuousValues ActuatorGuard::brake(const StateValues& state) const noexcept {
  return {model_.saturated_motor_force(-braking_n_s_m * state[velocity])};
}

LadderSettings actuator_ladder(const ActuatorParameters& p) {
  constexpr double margin_pa = 50e3;
  SensorBounds position{-0.0095, 0.1095, -0.01, 0.11, 3e-5, 2.5e-3, 3e-5};
  position.stuck_ticks = 100;    // of the noise that the rig has: 22 would do (stuck_ticks_of)
  position.stuck_change = 3e-4;  // 20 steps of its converter; 2 of a rig's that has coarser ones (rig_file.cpp)
  SensorBounds pressure{60e3, 310e3, 101325.0 - 210e3, 101325.0 + 210e3, 1e3, 30e3, 150.0};
  pressure.stuck_change = 25e3;
  pressure.supply_low = p.atmospheric_pressure_pa - margin_pa;
  pressure.supply_high = p.supply_pressure_pa + margin_pa;
  LadderSettings settings;
  settings.plausibility.channels = {position, pressure, pressure};
  settings.limits = {{.low = -0.005, .high = 0.1085, .fault = Fault::axis_limit},
                     {.high = 305e3, .fault = Fault::channel_limit},
                     {.high = 305e3, .fault = Fault::channel_limit}};
  settings.needed_to_stop = {position_channel};
  settings.needed_to_plan = {pressure_a_channel, pressure_b_channel};
  return settings;
}

}  // namespace solenoid
