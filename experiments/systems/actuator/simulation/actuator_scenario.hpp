#pragma once

#include "core/systems/actuator/parameters.hpp"
#include "experiments/campaign/scenario.hpp"
#include "experiments/systems/actuator/twin/twin_parameters.hpp"

#include <optional>
#include <string>

namespace solenoid {

class SimulatedSystem;

/// A blow to the plant's slide that the controller does not see coming: its velocity jumps.
struct Kick {
  double at_s = 0.0, speed_m_s = 0.0;
};

/// What a scenario of the actuator says beside what every scenario does: the plant, which the controller is never told.
struct ActuatorScenario {
  Plane plane = Plane::vertical;
  double payload_kg = 0.0;
  std::string plant = "model";           ///< model: the controller's own equations; twin: the truth plant
  TwinParameters twin = nominal_twin();  ///< the plant's parameters if plant is twin
  Mismatch mismatch;
  bool sensing_chain = false;  ///< raw potentiometer, spikes, Bessel filter and converters between plant and controller
  std::optional<Kick> kick;
};

/// A scenario's own settings, which are the actuator's.
inline const ActuatorScenario& actuator(const ScenarioConfig& scenario) { return scenario.own.as<ActuatorScenario>(); }
/// The same, to be changed.
inline ActuatorScenario& actuator(ScenarioConfig& scenario) { return scenario.own.as<ActuatorScenario>(); }

/// How the actuator is simulated.
const SimulatedSystem& actuator_simulation();

/// Moves the arm's plane, in the plant and in what controllers are told.
void set_plane(ScenarioConfig& scenario, Plane plane);

/// Reads the plant's keys of a scenario's table. Throws ConfigError with file, line, key and what is allowed.
void read_actuator_scenario(TableReader& table, ScenarioConfig& scenario);

}  // namespace solenoid
