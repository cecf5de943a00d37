#include "experiments/campaign/simulate.hpp"

#include "controllers/factory.hpp"
#include "controllers/timing.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"

#include <cmath>

namespace solenoid {

RunResult simulate(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed,
                   const SolverDecorator& decorate) {
  const std::unique_ptr<SimulatedPlant> plant = make_plant(variant, scenario, seed);
  const auto controller = make_controller(variant, scenario.trajectory, scenario.plane, decorate);
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
