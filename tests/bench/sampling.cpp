// Sampled sequences of modes on recorded closed-loop problems whose optima are proven, pinned to one core: how often the
// optimum is found, how far off the plan is and how long it took, against the number of samples and against a budget.
// nine_robust's 1,024 samples are of 40 steps.
#include "controllers/compiled_solvers.hpp"
#include "controllers/factory.hpp"
#include "controllers/instances/instance_set.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/metrics/metrics.hpp"
#include "experiments/profile/profiling.hpp"
#include "solvers/sampling/mode_sampling.hpp"
#include "tests/bench/timing.hpp"

#include <string>
#include <vector>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Predicted = PrestabilisedActuator;

void measure(const InstanceSet& set, const VariantInstances& variant, const ModeSamplingSettings& settings,
             double budget_us) {
  std::vector<double> gaps, times;
  std::size_t optimal = 0;
  const auto solver = make_sampling<Predicted>(settings);
  for (std::uint32_t motion = 0; motion < set.motions.size(); ++motion) {
    auto problem = make_problem<Predicted>(told(variant.config, set.motions[motion]));
    solver->prepare(problem);
    Plan<Predicted> plan(problem);
    for (const InstanceRecord& record : variant.records) {
      if (record.motion != motion || record.plan_status != Status::optimal) continue;
      pose(set, record, problem, plan);
      plan.relaxation.known = false;
      const SolveReport report =
          solver->solve(problem, plan, budget_us > 0 ? Deadline::after_s(1e-6 * budget_us) : Deadline::never());
      const double gap = report.cost == record.plan_cost ? 0.0 : report.cost / record.plan_cost - 1.0;
      gaps.push_back(100.0 * gap);
      optimal += gap <= 0.0;
      times.push_back(report.time_us);
    }
  }
  const Percentiles gap = percentiles(gaps), us = percentiles(times);
  fmt::print(
      "{:12s} {:13s} {:6d} samples in {:3d} updates, {:>7s}: {:3.0f} % at the optimum, gap p90 {:6.1f} % p99 {:7.1f} "
      "%, us p50 {:6.0f} p99 {:6.0f}\n",
      variant.name, settings.update == SamplingUpdate::elites ? "cross_entropy" : "mppi", settings.samples,
      settings.iterations, budget_us > 0 ? fmt::format("{:g} us", budget_us) : "no limit",
      100.0 * static_cast<double>(optimal) / static_cast<double>(gaps.size()), gap.p90, gap.p99, us.p50, us.p99);
}

}  // namespace
}  // namespace solenoid

int main() {
  using namespace solenoid;
  solenoid::bench::pin_to_core(1);
  const InstanceSet set = instances_from("");
  for (const VariantInstances& variant : set.variants) {
    if (variant.name != "nine_robust" && variant.name != "nine_state_4") continue;
    for (const SamplingUpdate update : {SamplingUpdate::elites, SamplingUpdate::weights}) {
      const ModeSamplingSettings base{.update = update};
      for (const auto& [samples, iterations] :
           {std::pair{128, 2}, {256, 4}, {512, 4}, {1024, 1}, {1024, 4}, {1024, 8}, {4096, 8}}) {
        ModeSamplingSettings settings = base;
        settings.samples = samples;
        settings.iterations = iterations;
        measure(set, variant, settings, 0);
      }
      for (const double budget_us : {100.0, 500.0, 2000.0}) {
        ModeSamplingSettings settings = base;
        settings.samples = 1 << 20;
        settings.iterations = settings.samples / 128;
        measure(set, variant, settings, budget_us);
      }
    }
  }
}
