// Time and nodes of exact search over valve banks, on recorded closed-loop states, pinned to one core. Prints, for each
// bank and horizon, the median, p99, p99.9 and worst over the instances of the best of several repetitions each, and how
// many sequences there are.
#include "core/metrics/metrics.hpp"
#include "solvers/search/rollout_kernels.hpp"
#include "tests/bench/timing.hpp"
#include "tests/support/recorded_problems.hpp"

#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

namespace solenoid::test {
namespace {

/// The weights of the shipped variants for the rig.
template <class M>
Problem<M> bank_problem(const char* valves, const std::vector<int>& periods, double switching) {
  auto problem = actuator_problem<M>(valves, periods, switching);
  problem.cost.terminal = {30.0, 0.02};
  problem.cost.consumption = 1e-4;
  return problem;
}

template <class M>
void measure(const char* model, const char* valves, const std::vector<int>& periods, double switching, double kick,
             std::size_t one_in, int repetitions) {
  auto problem = bank_problem<M>(valves, periods, switching);
  const double start = problem.model.parameters().equilibrium_position_m();
  BranchAndBound<M> search;
  std::vector<RecordedInstance<M>> all;
  for (const Trajectory& motion : {thesis_sine(start), thesis_cycloidal(start)}) {
    const auto some = record_closed_loop(problem, motion, search, kick);
    for (std::size_t i = 0; i < some.size(); i += one_in) all.push_back(some[i]);
  }
  search.prepare(problem);
  std::vector<double> best(all.size(), 1e300), nodes(all.size()), bounds(all.size());
  for (int r = 0; r < repetitions; ++r)
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i].pose(problem);
      Plan<M> plan = all[i].warm_start;
      const SolveReport report = search.solve(problem, plan, Deadline::never());
      best[i] = std::min(best[i], report.time_us);
      nodes[i] = static_cast<double>(report.nodes);
      bounds[i] = static_cast<double>(report.bound_steps);
    }
  const Percentiles t = percentiles(best), n = percentiles(nodes), b = percentiles(bounds);
  fmt::print(
      "{:8s} {:12s} {:3d}^{} of {:9.0f} w {:.0e} kick {:.1f}: {:4d} states, us p50 {:8.1f} p99 {:8.1f} p99.9 {:8.1f} "
      "max {:8.1f} | "
      "nodes p50 {:6.0f} p99 {:7.0f} max {:7.0f} | bound steps p50 {:6.0f} p99 {:7.0f}\n",
      model, valves, problem.modes.size(), periods.size(), std::pow(problem.modes.size(), periods.size()), switching,
      kick, all.size(), t.p50, t.p99, t.p999, t.max, n.p50, n.p99, n.max, b.p50, b.p99);
}

/// Along the thesis's motions, and pushed off them by 0.3 m/s twice a second, where no bound says much.
template <class M>
void banks(const char* model) {
  constexpr double switching = 1.2e-8;
  for (const double kick : {0.0, 0.3}) {
    measure<M>(model, "two_way", {1, 1, 2, 4}, switching, kick, 1, 3);
    measure<M>(model, "dual_orifice", {1, 1, 2, 4}, switching, kick, 1, 3);
    measure<M>(model, "pcm_2", {2, 6}, switching, kick, 1, 3);
    measure<M>(model, "pcm_2", {1, 3, 4}, switching, kick, 1, 3);
    measure<M>(model, "pcm_3", {2, 6}, switching, kick, 1, 3);
    measure<M>(model, "pcm_4", {2, 6}, switching, kick, 8, 1);
  }
}

}  // namespace
}  // namespace solenoid::test

int main() {
  using namespace solenoid;
  solenoid::bench::pin_to_core(1);
  test::banks<PrestabilisedActuator>("hybrid");
  test::banks<PneumaticActuator>("cylinder");
}
