// Times one solve of the thesis's search (one block, N_p = 100) on the problems of recorded closed-loop runs: the sine
// and the cycloid of chapter 6 from their start, 1,600 periods each, for the four states of the 3-way valves and the
// nine of the 2-way valves. Prints median, 99th percentile and maximum; run it pinned or let it pin itself.
#include "controllers/factory.hpp"
#include "controllers/timing.hpp"
#include "experiments/sim/simulate.hpp"

#include <algorithm>
#include <cstdio>

#include <sched.h>

namespace solenoid {
namespace {

struct Instance {
  ActuatorState state{};
  SwitchLines lines;
  std::vector<OutputOf<PneumaticActuator>> reference;
};

VariantConfig dmpc(const char* valves) {
  VariantConfig variant;
  variant.name = valves;
  variant.valves = valves;
  variant.integral.gain = 0.005;
  return variant;
}

/// The problems a run's controller solved, rebuilt from its record: estimate, commands in flight, shifted reference.
std::vector<Instance> record(const VariantConfig& variant, const Trajectory& trajectory, std::size_t steps) {
  ScenarioConfig scenario;
  scenario.trajectory = trajectory;
  const Problem<PneumaticActuator> problem = make_problem(variant, Plane::vertical);
  const SwitchTiming timing(problem.modes, tick_s);
  SwitchLines lines(0);
  std::vector<Instance> instances;
  for (const TickRecord& tick : simulate(variant, scenario, 1).ticks) {
    if (tick.decision.solved) {
      Instance instance{problem.model.nearest_valid(tick.decision.estimate), lines, {}};
      for (std::size_t j = 0; j < steps; ++j) {
        const ReferenceSample ahead = trajectory.at(tick.sensors.time_s + static_cast<double>(j + 1) * tick_s);
        instance.reference.push_back({ahead.position + tick.decision.offset_m, ahead.velocity});
      }
      instances.push_back(std::move(instance));
    }
    lines.command(tick.applied.coils, timing);
    lines.advance(1);
  }
  return instances;
}

void time_solves(const char* valves, const char* name, const Trajectory& trajectory, int repeats) {
  const VariantConfig variant = dmpc(valves);
  Problem<PneumaticActuator> problem = make_problem(variant, Plane::vertical);
  const std::vector<Instance> instances = record(variant, trajectory, problem.reference.size());
  const auto solver = make_solver(variant.solver);
  solver->prepare(problem);
  Plan<PneumaticActuator> plan(problem);
  std::vector<double> time_us;
  double checksum = 0;
  for (int repeat = 0; repeat < repeats; ++repeat)
    for (const Instance& instance : instances) {
      problem.initial = instance.state;
      problem.lines = instance.lines;
      std::ranges::copy(instance.reference, problem.reference.begin());
      const Report report = solver->solve(problem, plan, Deadline::never());
      time_us.push_back(report.time_us);
      checksum += report.cost * (1 + plan.modes.front());
    }
  const Percentiles p = percentiles(time_us);
  std::printf("%-10s %-10s %5zu problems x %d   median %7.2f   p99 %7.2f   max %8.2f us   checksum %.17g\n", valves,
              name, instances.size(), repeats, p.p50, p.p99, p.max, checksum);
}

void pin_to_one_core() {
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(sched_getcpu(), &one);
  if (sched_setaffinity(0, sizeof one, &one) != 0) std::fprintf(stderr, "not pinned: timings will be noisier\n");
}

}  // namespace
}  // namespace solenoid

int main() {
  using namespace solenoid;
  pin_to_one_core();
  const double start_m = ActuatorParameters{}.equilibrium_position_m();
  for (const char* valves : {"three_way", "two_way"}) {
    time_solves(valves, "sine", thesis_sine(start_m), 5);
    time_solves(valves, "cycloidal", thesis_cycloidal(start_m), 5);
  }
}
