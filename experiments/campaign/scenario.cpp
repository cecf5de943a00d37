#include "experiments/campaign/scenario.hpp"

#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"

#include <fmt/format.h>

namespace solenoid {

ScenarioConfig read_scenario(TableReader& table) {
  ScenarioConfig s;
  s.name = table.text("name");
  static_cast<PlantConfig&>(s) = read_plant_config(table);

  const ActuatorParameters unloaded;
  TableReader trajectory = table.table("trajectory");
  s.trajectory = read_trajectory(trajectory, unloaded.equilibrium_position_m());
  s.trajectory_kind = trajectory.text("kind");
  const auto [low, high] = s.trajectory.axes().front().range();
  if (low < unloaded.position_min_m() || high > unloaded.position_max_m())
    table.fail("trajectory",
               fmt::format("reaches from {:.4g} to {:.4g} m (allowed: inside the stroke, {:.4g} to {:.4g} m)", low,
                           high, unloaded.position_min_m(), unloaded.position_max_m()));
  s.duration_s = table.number_or("duration_s", s.trajectory.duration_s(), {0.0, 3600.0, true});
  if (table.has("timing")) {
    TableReader timing = table.table("timing");
    s.timing = read_timing_keys(timing);
    with_keys(actuator_description().timing, s.timing, table.where("timing"));
  }
  table.finish();
  return s;
}

std::unique_ptr<SimulatedPlant> make_plant(const VariantConfig& variant, const ScenarioConfig& scenario,
                                           std::uint64_t seed) {
  return make_plant(timed(variant, scenario.timing, scenario.name), scenario, scenario.trajectory.start()[0], seed);
}

}  // namespace solenoid
