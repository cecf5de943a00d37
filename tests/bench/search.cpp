// Time and nodes of the searches on recorded closed-loop states, pinned to one core. Prints, for each problem, the
// median, p99, p99.9 and worst over the instances of the best of several repetitions each.
#include "core/metrics/metrics.hpp"
#include "solvers/search/exhaustive.hpp"
#include "solvers/search/rollout_kernels.hpp"
#include "tests/bench/timing.hpp"
#include "tests/support/recorded_problems.hpp"

#include <fmt/format.h>

namespace solenoid::test {
namespace {

template <HybridModel M>
std::vector<RecordedInstance<M>> instances(const Problem<M>& problem) {
  const double start = problem.model.parameters().equilibrium_position_m();
  std::vector<RecordedInstance<M>> all;
  for (const Trajectory& motion : {thesis_sine(start), thesis_cycloidal(start)}) {
    BranchAndBound<M> solver;
    const auto some = record_closed_loop(problem, motion, solver);
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

template <HybridModel M>
double measure(const char* what, Problem<M> problem, Solver<M>& solver, const std::vector<RecordedInstance<M>>& all,
               double full_tree, int repetitions, bool warm = true) {
  solver.prepare(problem);
  std::vector<double> best(all.size(), 1e300), nodes(all.size());
  for (int r = 0; r < repetitions; ++r)
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i].pose(problem);
      Plan<M> plan = warm ? all[i].warm_start : Plan<M>(problem);
      const SolveReport report = solver.solve(problem, plan, Deadline::never());
      best[i] = std::min(best[i], report.time_us);
      nodes[i] = static_cast<double>(report.nodes);
    }
  const Percentiles t = percentiles(best), n = percentiles(nodes);
  fmt::print(
      "{:44s} us p50 {:8.2f} p99 {:8.2f} p99.9 {:8.2f} max {:8.2f} | nodes p50 {:5.0f} ({:.2f} %) p99 {:6.0f} max "
      "{:6.0f}\n",
      what, t.p50, t.p99, t.p999, t.max, n.p50, 100 * n.p50 / full_tree, n.p99, n.max);
  return t.p50;
}

/// What bounds a roll: one register has only its own latency to wait for, several hide each other's.
void kernel_steps() {
  using M = PneumaticActuator;
  const auto problem = actuator_problem<M>("three_way", {20});
  const std::vector<ContinuousOf<M>> planned(100);
  LaneInputs<M> inputs;
  inputs.reserve(1);
  inputs.pieces = 1;
  Lanes<M> start{};
  for (std::size_t lane = 0; lane < max_lanes; ++lane) {
    start.state[0][lane] = 0.05;
    start.state[1][lane] = 0.1;
    start.state[2][lane] = start.state[3][lane] = 1.5e5;
    for (std::size_t k = 0; k < 4; ++k) inputs.piece[0].value[k][lane] = (lane >> (k / 2) & 1) == (k & 1);
  }
  for (const auto& kernel : runnable_kernels<M>())
    for (int lanes = kernel.width; lanes <= max_lanes; lanes *= 2) {
      start.count = lanes;
      double best = 1e300;
      for (int r = 0; r < 2000; ++r) {
        Lanes<M> now = start;
        const auto begin = Deadline::Clock::now();
        kernel.roll(problem, {planned.data(), 0, 100, Bounds<M>::infinity}, inputs, now);
        best = std::min(best, std::chrono::duration<double, std::nano>(Deadline::Clock::now() - begin).count());
      }
      fmt::print("kernel {:8s} {:2d} lanes: {:6.1f} ns a step, {:5.2f} ns a lane and step\n", kernel.architecture,
                 lanes, best / 100, best / 100 / lanes);
    }
}

double full_tree(const Problem<PneumaticActuator>& p) {
  double nodes = 0, level = 1;
  for (std::size_t b = 0; b < p.horizon.blocks.size(); ++b) nodes += level *= p.modes.size();
  return nodes;
}

void one_block(const char* valves) {
  auto problem = actuator_problem<PneumaticActuator>(valves, {20});
  const auto all = instances(problem);
  Exhaustive<PneumaticActuator> scalar;
  BranchAndBound<PneumaticActuator> enumerate({false, 0}), search;
  const double full = full_tree(problem);
  const double slow =
      measure(fmt::format("{} one block, scalar enumeration", valves).c_str(), problem, scalar, all, full, 3);
  const double fast =
      measure(fmt::format("{} one block, SIMD enumeration", valves).c_str(), problem, enumerate, all, full, 7);
  measure(fmt::format("{} one block, branch and bound", valves).c_str(), problem, search, all, full, 7);
  fmt::print("{}: scalar / SIMD = {:.1f}\n", valves, slow / fast);
}

template <class M>
void blocks(const char* name, const char* valves, const std::vector<int>& periods, double switching, int repetitions) {
  auto problem = actuator_problem<M>(valves, periods, switching);
  const auto all = instances(problem);
  BranchAndBound<M> search;
  const double full = full_tree(actuator_problem<PneumaticActuator>(valves, periods));
  measure(fmt::format("{} {}^{} warm, w {:.0e}", name, problem.modes.size(), periods.size(), switching).c_str(),
          problem, search, all, full, repetitions);
  measure(fmt::format("{} {}^{} cold, w {:.0e}", name, problem.modes.size(), periods.size(), switching).c_str(),
          problem, search, all, full, repetitions, false);
}

/// How punctual a solve is that is told to stop: time over the deadline, of the instances that needed more. The least
/// of a few repetitions each is the solver's own lateness; all of them together have the machine's in it too.
void deadline_overrun(double budget_us) {
  auto problem = actuator_problem<PrestabilisedActuator>("two_way", {1, 1, 2, 2, 4, 10});
  const auto all = instances(problem);
  BranchAndBound<PrestabilisedActuator> search;
  search.prepare(problem);
  std::vector<double> own, any;
  for (const auto& instance : all) {
    double least = 1e300;
    for (int r = 0; r < 5; ++r) {
      instance.pose(problem);
      Plan<PrestabilisedActuator> plan = instance.warm_start;
      const auto budget = std::chrono::nanoseconds(static_cast<int>(1000 * budget_us));
      const SolveReport report = search.solve(problem, plan, Deadline::after(budget));
      if (report.status != Status::deadline_reached) continue;
      least = std::min(least, report.time_us - budget_us);
      any.push_back(report.time_us - budget_us);
    }
    if (least < 1e300) own.push_back(least);
  }
  fmt::print("hybrid 9^6 with a deadline of {:.0f} us: {} of {} instances stopped\n", budget_us, own.size(),
             all.size());
  for (auto [what, late] : {std::pair{"least of 5 runs", own}, std::pair{"all runs", any}}) {
    const Percentiles t = percentiles(late);
    fmt::print("  late by us, {:15s} p50 {:6.2f} p99 {:8.2f} p99.9 {:8.2f} max {:8.2f}\n", what, t.p50, t.p99, t.p999,
               t.max);
  }
}

}  // namespace
}  // namespace solenoid::test

int main() {
  using namespace solenoid;
  using namespace solenoid::test;
  solenoid::bench::pin_to_core(1);
  fmt::print("kernel: {}, {} doubles a register\n", rollout_kernel<PneumaticActuator>().architecture,
             rollout_kernel<PneumaticActuator>().width);
  kernel_steps();
  deadline_overrun(250);
  one_block("three_way");
  one_block("two_way");
  for (const double switching : {0.0, 2e-8}) {
    blocks<PneumaticActuator>("cylinder", "two_way", {2, 2, 4, 12}, switching, 3);
    blocks<PrestabilisedActuator>("hybrid", "two_way", {2, 2, 4, 12}, switching, 3);
    blocks<PrestabilisedActuator>("hybrid", "three_way", {1, 1, 1, 1, 2, 2, 4, 8}, switching, 2);
    blocks<PrestabilisedActuator>("hybrid", "two_way", {1, 1, 2, 2, 4, 10}, switching, 1);
  }
}
