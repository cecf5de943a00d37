#pragma once

#include "core/rt/io.hpp"
#include "core/system/description.hpp"
#include "core/systems/actuator/dynamics.hpp"

namespace solenoid {

/// Indices into the actuator's measured channels.
enum ActuatorChannel : std::size_t { position_channel = 0, pressure_a_channel = 1, pressure_b_channel = 2 };
/// How many channels it has.
inline constexpr std::size_t actuator_channels = 3;
/// Its two switched pressures, for loops over them.
inline constexpr ActuatorChannel pressure_channels[] = {pressure_a_channel, pressure_b_channel};

/// Indices into what its estimators believe beyond the state. The first two are in the description, and so in logs.
enum ActuatorBelief : std::size_t {
  payload_belief,            ///< [kg]
  disturbance_belief,        ///< external force on the slide [N]
  payload_sigma_belief,      ///< standard deviation [kg]
  disturbance_sigma_belief,  ///< [N]
  flow_factor_belief,        ///< of every valve
  friction_factor_belief,
};

/// Sampling of the thesis (chapter 5): T_s 1 ms, T_sp 5 ms.
inline constexpr Timing actuator_timing{0.001, 5};

/// The actuator's state in a record.
inline ActuatorState actuator_state(const StateValues& values) noexcept { return first<4>(values); }

/// A command to the coils and the motor.
inline Command actuator_command(SwitchPattern coils, double motor_n) noexcept { return {coils, {motor_n}}; }

/// The motor's force in a command [N].
inline double motor_force_n(const Command& command) noexcept { return command.continuous[0]; }

/// The hybrid pneumatic-electric actuator as everything above the solvers knows it.
const SystemDescription& actuator_description();
/// The same on servo valves: with their two commands as further continuous inputs, in the order of ServoInputIndex. What
/// has no such valves keeps its logs, packets and tables without them.
const SystemDescription& servo_description();

}  // namespace solenoid
