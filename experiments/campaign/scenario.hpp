#pragma once

#include "core/reference/motion.hpp"
#include "experiments/systems/actuator/plants/make_plant.hpp"

#include <memory>
#include <string>

namespace solenoid {

/// A task and the plant it is done on, as data: one [[scenario]] table.
struct ScenarioConfig : PlantConfig {
  std::string name;
  std::string trajectory_kind;
  Motion trajectory{Trajectory(0.0)};
  TimingKeys timing;  ///< in place of the system's
  double duration_s = 8.0;
};

/// Reads one scenario; the motion starts at the hanging equilibrium of the unloaded arm unless it says from_m. Throws
/// ConfigError with file, line, key and what is allowed.
ScenarioConfig read_scenario(TableReader& table);

/// The scenario's plant with this variant's valves, where the motion starts.
std::unique_ptr<SimulatedPlant> make_plant(const VariantConfig& variant, const ScenarioConfig& scenario,
                                           std::uint64_t seed);

}  // namespace solenoid
