#pragma once

#include "core/systems/actuator/parameters.hpp"
#include "experiments/systems/actuator/twin/twin_parameters.hpp"

#include <optional>
#include <string>

namespace solenoid {

class TableReader;

/// A blow to the plant's slide that the controller does not see coming: its velocity jumps.
struct Kick {
  double at_s = 0.0, speed_m_s = 0.0;
};

/// The plant of a scenario, as data: the keys of its table that the controller is never told.
struct PlantConfig {
  Plane plane = Plane::vertical;
  double payload_kg = 0.0;
  std::string plant = "model";           ///< model: the controller's own equations; twin: the truth plant
  TwinParameters twin = nominal_twin();  ///< the plant's parameters if plant is twin
  Mismatch mismatch;
  bool noise = false;
  bool ideal_sensing = true;   ///< controllers read the true state
  bool sensing_chain = false;  ///< raw potentiometer, spikes, Bessel filter and converters between plant and controller
  std::optional<Kick> kick;
};

/// Reads the plant's keys of a scenario's table and leaves the others to whoever finishes it. Throws ConfigError with
/// file, line, key and what is allowed.
PlantConfig read_plant_config(TableReader& table);

/// Throws ConfigError, `where` in front, for a tick that the plant cannot be sampled at: the twin's sensors are sampled
/// ten times a millisecond.
void check_tick(const PlantConfig& config, double tick_s, const std::string& where);

}  // namespace solenoid
