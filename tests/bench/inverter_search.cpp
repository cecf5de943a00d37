// Branch and bound on the three-level inverter, pinned to one core, beside the 25 us of its sampling period: time and
// nodes by horizon on random moments of the rated point and in closed loop, then what a longer horizon is good for, the
// distortion of the current at equal switching frequency. A number as argument: the longest horizon (10).
#include "core/metrics/metrics.hpp"
#include "core/mpc/rollout.hpp"
#include "solvers/search/branch_and_bound.hpp"
#include "tests/bench/timing.hpp"
#include "tests/support/inverter_problems.hpp"
#include "tests/support/sphere_decoder.hpp"

#include <bit>
#include <complex>
#include <cstdlib>

#include <fmt/format.h>

namespace solenoid::test {
namespace {

constexpr double period_us = 25.0;
constexpr double devices = 12.0;  // of a three-phase neutral-point-clamped inverter

void print_row(const std::string& what, std::vector<double> us, std::vector<double> nodes) {
  const Percentiles t = percentiles(us), n = percentiles(nodes);
  double late = 0;
  for (const double time : us) late += time > period_us;
  fmt::print(
      "{:32s} us p50 {:8.2f} p90 {:8.2f} p99 {:9.2f} max {:9.2f} over 25 us {:5.1f} % | nodes p50 {:6.0f} p99 "
      "{:7.0f} max {:7.0f}\n",
      what, t.p50, t.p90, t.p99, t.max, 100 * late / static_cast<double>(us.size()), n.p50, n.p99, n.max);
}

/// Random moments, without a warm start: the best of three repetitions each.
void random_moments(int steps, double lambda) {
  auto problem = inverter_problem(steps, lambda);
  BranchAndBound<InverterLoad> search;
  search.prepare(problem);
  SphereDecoder decoder(problem.model.parameters(), problem.horizon.dt_s, steps, lambda);
  std::mt19937_64 random(1);
  std::vector<double> us, nodes, decoder_nodes;
  for (int i = 0; i < 300; ++i) {
    pose_at_random(problem, random);
    SolveReport report;
    double best = 1e300;
    for (int r = 0; r < 3; ++r) {
      Plan<InverterLoad> plan(problem);
      report = search.solve(problem, plan, Deadline::never());
      best = std::min(best, report.time_us);
    }
    us.push_back(best);
    nodes.push_back(static_cast<double>(report.nodes));
    std::vector<Eigen::Vector2d> reference;
    for (const auto& r : problem.reference) reference.emplace_back(r[0], r[1]);
    const auto level = problem.modes.point(problem.lines.commanded());
    const auto& x = problem.initial;
    const auto decoded =
        decoder.solve({x[0], x[1], x[2], x[3]},
                      {static_cast<int>(level[0]), static_cast<int>(level[1]), static_cast<int>(level[2])}, reference);
    decoder_nodes.push_back(static_cast<double>(decoded.nodes));
  }
  print_row(fmt::format("random N {:2d} lambda {:6.0f}", steps, lambda), us, nodes);
  const Percentiles d = percentiles(decoder_nodes);
  fmt::print("{:32s} sphere decoder's nodes (a phase each): p50 {:.0f} p99 {:.0f} max {:.0f}\n", "", d.p50, d.p99,
             d.max);
}

/// A closed loop at the rated point with the controller's own model as the plant.
struct ClosedLoop {
  double switching_hz = 0.0, distortion_percent = 0.0;
  std::vector<double> us, nodes;
};

/// The distortion is relative to the rated current, over whole periods of the fundamental after the first two.
ClosedLoop closed_loop(int steps, double lambda, int periods) {
  auto problem = inverter_problem(steps, lambda);
  BranchAndBound<InverterLoad> search;
  search.prepare(problem);
  const InverterParameters& p = problem.model.parameters();
  const double turn = 2 * std::numbers::pi * p.emf_frequency_hz * p.sampling_s;
  const int settle = static_cast<int>(std::lround(2 * 2 * std::numbers::pi / turn));
  const int ticks = settle + static_cast<int>(std::lround(periods * 2 * std::numbers::pi / turn));
  const SwitchTiming timing(problem.modes, p.sampling_s);
  pose_rated(problem, 0.0, {0.0, 0.0});
  problem.lines = DelayLines(problem.modes.pattern(0));
  StateOf<InverterLoad> x = problem.initial;
  Plan<InverterLoad> plan(problem);
  ClosedLoop loop;
  long switches = 0;
  std::complex<double> fundamental = 0.0;
  double square = 0.0;
  for (int k = 0; k < ticks; ++k) {
    pose_rated(problem, k * turn, {0.0, 0.0});
    problem.initial = x;
    const SolveReport report = search.solve(problem, plan, Deadline::never());
    const SwitchPattern pattern = problem.modes.pattern(plan.modes[0]);
    if (k >= settle) {
      loop.us.push_back(report.time_us);
      loop.nodes.push_back(static_cast<double>(report.nodes));
      switches += std::popcount(pattern ^ problem.lines.commanded());
      const std::complex<double> current(x[0], x[1]);
      fundamental += current * std::polar(1.0, -k * turn);
      square += std::norm(current);
    }
    problem.lines.command(pattern, timing);
    const auto level = problem.modes.point(problem.lines.effective());
    x = problem.model.step<double>(x, {level[0], level[1], level[2]}, {}, p.sampling_s);
    problem.lines.advance(1);
    shift_plan(problem.horizon, 1, plan);
  }
  const double count = ticks - settle;
  // A level's change turns one device on and one off.
  loop.switching_hz = static_cast<double>(switches) / (devices * count * p.sampling_s);
  loop.distortion_percent =
      100 * std::sqrt(std::max(square / count - std::norm(fundamental / count), 0.0)) / p.rated_current_a;
  return loop;
}

/// The weight that gives about this switching frequency, by bisection of its logarithm.
double weight_for(int steps, double switching_hz) {
  double low = 10.0, high = 1e6;
  for (int i = 0; i < 9; ++i) {
    const double middle = std::sqrt(low * high);
    (closed_loop(steps, middle, 5).switching_hz > switching_hz ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

}  // namespace
}  // namespace solenoid::test

int main(int argc, char** argv) {
  using namespace solenoid;
  using namespace solenoid::test;
  solenoid::bench::pin_to_core(0);
  const int longest = argc > 1 ? std::atoi(argv[1]) : 10;
  fmt::print("kernel {}, {} lanes a register\n", rollout_kernel<InverterLoad>().architecture,
             rollout_kernel<InverterLoad>().width);
  for (int steps = 1; steps <= longest; ++steps) random_moments(steps, 3000.0);
  for (const double wanted_hz : {300.0, 250.0})
    for (const int steps : {1, 2, 3, 5, 7, 10}) {
      if (steps > longest) continue;
      const double lambda = weight_for(steps, wanted_hz);
      const ClosedLoop loop = closed_loop(steps, lambda, 20);
      fmt::print("closed loop N {:2d} lambda {:7.0f} A^2: {:5.1f} Hz a device, distortion {:5.2f} % of rated\n", steps,
                 lambda, loop.switching_hz, loop.distortion_percent);
      print_row("", loop.us, loop.nodes);
    }
}
