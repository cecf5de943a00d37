#pragma once

#include "controllers/variant.hpp"
#include "core/metrics/metrics.hpp"
#include "core/reference/trajectory.hpp"
#include "experiments/plants/simulated_plant.hpp"
#include "experiments/plants/twin_parameters.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

class SolverWrapper;
class TableReader;

/// A blow to the plant's slide that the controller does not see coming: its velocity jumps.
struct Kick {
  double at_s = 0.0, speed_m_s = 0.0;
};

/// A task and the plant it is done on, as data: one [[scenario]] table.
struct ScenarioConfig {
  std::string name;
  std::string trajectory_kind;
  Trajectory trajectory{0.0};
  Plane plane = Plane::vertical;
  double payload_kg = 0.0;               ///< the plant's; the controller is never told
  std::string plant = "model";           ///< model: the controller's own equations; twin: the truth plant
  TwinParameters twin = nominal_twin();  ///< the plant's parameters if plant is twin
  Mismatch mismatch;
  bool noise = false;
  bool ideal_sensing = true;   ///< controllers read the true state
  bool sensing_chain = false;  ///< raw potentiometer, spikes, Bessel filter and converters between plant and controller
  double duration_s = 8.0;
  std::optional<Kick> kick;
};

/// Reads one scenario; the motion starts at the hanging equilibrium of the unloaded arm unless it says from_m. Throws
/// ConfigError with file, line, key and what is allowed.
ScenarioConfig read_scenario(TableReader& table);

/// The scenario's plant with this variant's valves: "model" has the variant's believed parameters, "twin" its own.
std::unique_ptr<SimulatedPlant> make_plant(const VariantConfig& variant, const ScenarioConfig& scenario,
                                           std::uint64_t seed);

/// A finished run.
struct RunResult {
  Metrics metrics;
  std::vector<TickRecord> ticks;
};

/// One run on a fake clock: the control loop of the rig with a simulated plant. The same variant, scenario and seed
/// give the same result to the last bit, solver times aside. Throws ConfigError for impossible combinations.
/// `wrapper` gets at the controller's solver.
RunResult simulate(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                   SolverWrapper* wrapper = nullptr);

}  // namespace solenoid
