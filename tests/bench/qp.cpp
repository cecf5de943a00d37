// Both QP back ends on the recorded closed-loop problems, cold and warm: iterations and time per solve. An instance's
// time is the median over repetitions; printed are median, p99 and worst over the instances.
#include "solvers/qp/ocp_solver.hpp"
#include "solvers/qp/ocp_to_sparse.hpp"
#include "solvers/qp/sparse_solver.hpp"
#include "tests/support/recorded_qp.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>

namespace {

using namespace solenoid;
using namespace solenoid::qp;

constexpr int repetitions = 101;

struct Series {
  std::vector<double> time_us, iterations;
  int failures = 0;

  template <class Solve>
  void measure(const Solve& solve) {
    std::vector<double> times;
    Info info;
    for (int i = 0; i < repetitions; ++i) {
      const auto start = std::chrono::steady_clock::now();
      info = solve();
      times.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
    }
    std::nth_element(times.begin(), times.begin() + repetitions / 2, times.end());
    time_us.push_back(times[repetitions / 2]);
    iterations.push_back(info.iterations);
    failures += info.status != Status::optimal;
  }

  static double quantile(std::vector<double> values, double q) {
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
  }
  double mean_iterations() const {
    double sum = 0.0;
    for (const double one : iterations) sum += one;
    return sum / static_cast<double>(iterations.size());
  }
  void print(int horizon, const char* name) const {
    std::printf(
        "N=%d  %-34s  us: median %7.1f  p99 %7.1f  worst %7.1f (%.2f x median)   iterations: mean %5.2f  max %2.0f   "
        "failures %d\n",
        horizon, name, quantile(time_us, 0.5), quantile(time_us, 0.99), quantile(time_us, 1.0),
        quantile(time_us, 1.0) / quantile(time_us, 0.5), mean_iterations(), quantile(iterations, 1.0), failures);
  }
};

/// What the next period asks: one stage on, the last stage repeated, the state a little off the prediction.
OcpQp<4, 3> one_period_later(const OcpQp<4, 3>& problem, const OcpSolution<4, 3>& plan) {
  OcpQp<4, 3> next = problem;
  for (std::size_t k = 0; k + 2 < next.stages.size(); ++k) next.stages[k] = problem.stages[k + 1];
  next.stages[0].q_matrix.setZero();
  next.stages[next.stages.size() - 2].q_matrix = problem.stages.back().q_matrix;
  next.x0 = plan.x[1] * 1.01;
  return next;
}

OcpSolution<4, 3> shifted(const OcpSolution<4, 3>& plan) {
  OcpSolution<4, 3> next = plan;
  const auto move = [](auto& list) { std::move(list.begin() + 1, list.end(), list.begin()); };
  move(next.u), move(next.x), move(next.y), move(next.zu);
  return next;
}

void staged(int horizon, int active_set_steps, const char* note) {
  const auto all = test::recorded_qps(horizon);
  OcpSolver<4, 3> solver;
  solver.setup(all[0].problem, {.active_set_steps = active_set_steps});
  OcpSolution<4, 3> solution(horizon), before(horizon), start(horizon);
  Series cold, shift_cold, shift_warm, neighbour;
  for (const auto& one : all) {
    before = solution;
    cold.measure([&] { return solver.solve(one.problem, solution); });
    const auto plan = solution;
    const auto later = one_period_later(one.problem, plan);
    const auto guess = shifted(plan);
    shift_cold.measure([&] { return solver.solve(later, start); });
    shift_warm.measure([&] { return start = guess, solver.solve(later, start, Start::warm); });
    neighbour.measure([&] { return start = before, solver.solve(one.problem, start, Start::warm); });
  }
  std::printf("Riccati, %s\n", note);
  cold.print(horizon, "cold");
  shift_cold.print(horizon, "one period later, cold");
  shift_warm.print(horizon, "one period later, warm");
  neighbour.print(horizon, "warm from the recorded neighbour");
  std::printf("      cold / warm iterations, shifted: %.2f, neighbour: %.2f\n",
              shift_cold.mean_iterations() / shift_warm.mean_iterations(),
              cold.mean_iterations() / neighbour.mean_iterations());
}

void sparse(int horizon, int active_set_steps, const char* note) {
  const auto all = test::recorded_qps(horizon);
  SparseQp problem = to_sparse(all[0].problem);
  SparseSolver solver;
  solver.setup(problem, {.active_set_steps = active_set_steps});
  SparseSolution solution(problem), before = solution, start = solution;
  Series cold, neighbour;
  for (const auto& one : all) {
    problem = to_sparse(one.problem);
    before = solution;
    cold.measure([&] { return solver.solve(problem, solution); });
    neighbour.measure([&] { return start = before, solver.solve(problem, start, Start::warm); });
  }
  std::printf("AMD + LDL (%d unknowns, %d entries in L), %s\n", problem.variables() + problem.equalities(),
              solver.kkt().factor_entries(), note);
  cold.print(horizon, "cold");
  neighbour.print(horizon, "warm from the recorded neighbour");
  std::printf("      cold / warm iterations, neighbour: %.2f\n", cold.mean_iterations() / neighbour.mean_iterations());
}

}  // namespace

int main() {
  for (const int horizon : {20, 40}) {
    staged(horizon, Settings{}.active_set_steps, "as shipped");
    staged(horizon, 0, "interior point alone");
    sparse(horizon, Settings{}.active_set_steps, "as shipped");
    sparse(horizon, 0, "interior point alone");
  }
}
