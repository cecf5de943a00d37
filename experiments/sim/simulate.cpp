#include "experiments/sim/simulate.hpp"

#include "controllers/factory.hpp"
#include "controllers/timing.hpp"
#include "core/config/reader.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "experiments/sim/model_plant.hpp"

#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// The plant with a blow on the way.
class KickedPlant final : public Plant {
 public:
  KickedPlant(ModelPlant& plant, std::optional<Kick> kick) : plant_(plant), kick_(kick) {}
  Sensors read(double time_s) noexcept override {
    if (kick_ && time_s >= kick_->at_s) {
      plant_.push(kick_->speed_m_s);
      kick_.reset();
    }
    return plant_.read(time_s);
  }
  void write(const Command& command) noexcept override { plant_.write(command); }

 private:
  ModelPlant& plant_;
  std::optional<Kick> kick_;
};

}  // namespace

ScenarioConfig read_scenario(TableReader& table) {
  ScenarioConfig s;
  s.name = table.text("name");
  s.plane = table.text_or("plane", "vertical", {"vertical", "horizontal"}) == "vertical" ? Plane::vertical
                                                                                         : Plane::horizontal;
  s.payload_kg = table.number_or("payload_kg", 0.0, Range::between(0.0, 10.0));
  s.plant = table.text_or("plant", s.plant, {"model"});
  if (table.has("mismatch")) {
    TableReader mismatch = table.table("mismatch");
    s.mismatch = read_mismatch(mismatch);
  }
  s.noise = table.boolean_or("noise", false);
  s.ideal_sensing = table.text_or("sensing", s.noise ? "measured" : "ideal", {"ideal", "measured"}) == "ideal";
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
  }
  table.finish();
  return s;
}

RunResult simulate(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                   SolverWrapper* wrapper) {
  ActuatorParameters parameters = scenario.mismatch.applied_to(variant.believed);
  parameters.payload_mass_kg = scenario.payload_kg;
  parameters.plane = scenario.plane;
  ModelPlant plant(parameters, variant.valves, scenario.trajectory.start_m(),
                   {scenario.ideal_sensing, scenario.noise, {}, seed});
  const auto controller = make_controller(variant, scenario.trajectory, scenario.plane, wrapper);
  KickedPlant kicked(plant, scenario.kick);
  CommandLimits limits = make_limits(variant);
  const auto ticks = static_cast<std::int64_t>(std::llround(scenario.duration_s / tick_s));
  MemoryRecorder recorder(static_cast<std::size_t>(ticks));
  FakeClock clock;
  ControlLoop loop(kicked, clock, *controller, limits, recorder);
  loop.run(ticks, tick_s);

  RunResult result;
  result.metrics = evaluate_run(recorder.records(), scenario.trajectory, tick_s, plant.air_used_kg(), 1e6 * period_s);
  result.ticks = recorder.records();
  return result;
}

}  // namespace solenoid
