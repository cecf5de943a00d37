#include "experiments/campaign/simulate.hpp"

#include "controllers/factory.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "experiments/base/processes.hpp"
#include "experiments/campaign/run_in_progress.hpp"
#include "experiments/campaign/simulated_system.hpp"

namespace solenoid {

RunResult simulate(const VariantConfig& chosen, const ScenarioConfig& scenario, std::uint64_t seed,
                   const SolverDecorator& decorate) {
  const VariantConfig variant = told(chosen, scenario);
  const SimulatedSystem& simulation = simulation_of(scenario);
  const double tick_s = variant.timing.tick_s;
  RunInProgress run(scenario);
  const std::unique_ptr<SimulatedPlant> plant = simulation.make_plant(variant, scenario, seed);
  const auto controller = make_controller(variant, scenario.trajectory, decorate);
  CommandLimits limits = make_limits(variant);
  const auto ticks = variant.timing.ticks_in(scenario.duration_s);
  MemoryRecorder recorder(static_cast<std::size_t>(ticks));
  FakeClock clock;
  ControlLoop loop(*plant, clock, *controller, limits, recorder);
  const double steady_from_s = scenario.trajectory.steady_from_s().value_or(scenario.duration_s);
  double before = 0.0;
  loop.run(ticks, tick_s, [&] {
    work_goes_on();
    if (recorder.records().back().sensors.time_s < steady_from_s) before = plant->consumed();
    return run.failed();
  });
  run.require_sound();

  RunResult result;
  const Consumed consumed{plant->consumed(), plant->consumed() - before};
  result.metrics = simulation.evaluate(variant, scenario, recorder.records(), consumed);
  result.ticks = recorder.records();
  return result;
}

}  // namespace solenoid
