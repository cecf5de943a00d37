#include "experiments/campaign/simulate.hpp"

#include "controllers/factory.hpp"
#include "controllers/timing.hpp"
#include "core/config/reader.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "experiments/plants/model_plant.hpp"
#include "experiments/plants/twin_plant.hpp"

#include <cmath>
#include <filesystem>

#include <fmt/format.h>

namespace solenoid {
ScenarioConfig read_scenario(TableReader& table) {
  ScenarioConfig s;
  s.name = table.text("name");
  s.plane = table.text_or("plane", "vertical", {"vertical", "horizontal"}) == "vertical" ? Plane::vertical
                                                                                         : Plane::horizontal;
  s.payload_kg = table.number_or("payload_kg", 0.0, Range::between(0.0, 10.0));
  s.plant = table.text_or("plant", s.plant, {"model", "twin"});
  if (s.plant == "twin" && table.has("twin"))
    s.twin = read_twin_file((std::filesystem::path(table.folder()) / table.text("twin")).string());
  if (table.has("mismatch")) {
    TableReader mismatch = table.table("mismatch");
    s.mismatch = read_mismatch(mismatch);
  }
  s.noise = table.boolean_or("noise", false);
  if (table.has("noise_factor")) {
    if (s.plant != "twin") table.fail("noise_factor", "only the twin's sensors have it (allowed: plant = \"twin\")");
    s.twin.sensing.scale_noise(table.number("noise_factor", Range::between(0.0, 10.0)));
  }
  const std::string sensing = table.text_or("sensing", s.noise ? "measured" : "ideal", {"ideal", "measured", "chain"});
  s.ideal_sensing = sensing == "ideal";
  s.sensing_chain = sensing == "chain";
  if (s.noise && s.ideal_sensing) table.fail("sensing", "'ideal' has no noise (allowed: measured, or noise = false)");

  const ActuatorParameters unloaded;
  TableReader trajectory = table.table("trajectory");
  s.trajectory = read_trajectory(trajectory, unloaded.equilibrium_position_m());
  s.trajectory_kind = trajectory.text("kind");
  const auto [low, high] = s.trajectory.range_m();
  if (low < unloaded.position_min_m() || high > unloaded.position_max_m())
    table.fail("trajectory",
               fmt::format("reaches from {:.4g} to {:.4g} m (allowed: inside the stroke, {:.4g} to {:.4g} m)", low,
                           high, unloaded.position_min_m(), unloaded.position_max_m()));
  s.duration_s = table.number_or("duration_s", s.trajectory.duration_s(), {0.0, 3600.0, true});
  if (table.has("kick")) {
    TableReader kick = table.table("kick");
    s.kick = {kick.number("at_s", Range::non_negative()), kick.number("speed_m_s", Range::between(-5.0, 5.0))};
    kick.finish();
    if (s.plant != "model") table.fail("kick", "the twin takes none (allowed: plant = \"model\")");
  }
  table.finish();
  return s;
}

std::unique_ptr<SimulatedPlant> make_plant(const VariantConfig& variant, const ScenarioConfig& scenario,
                                           std::uint64_t seed) {
  const double start_m = scenario.trajectory.start_m();
  if (scenario.plant == "twin")
    return std::make_unique<TwinPlant>(
        twin_for(scenario.twin, {scenario.plane, scenario.payload_kg, scenario.mismatch}), variant.valves, start_m,
        TwinPlant::Sensing{scenario.ideal_sensing, scenario.noise, seed});
  ActuatorParameters parameters = scenario.mismatch.applied_to(variant.believed);
  parameters.payload_mass_kg = scenario.payload_kg;
  parameters.plane = scenario.plane;
  auto plant = std::make_unique<ModelPlant>(
      parameters, variant.valves, start_m,
      ModelPlant::Sensing{scenario.ideal_sensing, scenario.noise, scenario.sensing_chain, {}, seed});
  if (scenario.kick) plant->push_at(scenario.kick->at_s, scenario.kick->speed_m_s);
  return plant;
}

RunResult simulate(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                   SolverWrapper* wrapper) {
  const std::unique_ptr<SimulatedPlant> plant = make_plant(variant, scenario, seed);
  const auto controller = make_controller(variant, scenario.trajectory, scenario.plane, wrapper);
  CommandLimits limits = make_limits(variant);
  const auto ticks = static_cast<std::int64_t>(std::llround(scenario.duration_s / tick_s));
  MemoryRecorder recorder(static_cast<std::size_t>(ticks));
  FakeClock clock;
  ControlLoop loop(*plant, clock, *controller, limits, recorder);
  const double steady_from_s = scenario.trajectory.steady_from_s().value_or(scenario.duration_s);
  double air_before_kg = 0.0;
  loop.run(ticks, tick_s, [&] {
    if (recorder.records().back().sensors.time_s < steady_from_s) air_before_kg = plant->air_used_kg();
    return false;
  });

  RunResult result;
  const AirUse air{plant->air_used_kg(), plant->air_used_kg() - air_before_kg};
  result.metrics = evaluate_run(recorder.records(), scenario.trajectory, tick_s, air, 1e6 * period_s);
  result.ticks = recorder.records();
  return result;
}

}  // namespace solenoid
