// The recorded relaxed programs (20 stages): one real-time iteration, split in preparation and feedback, and the
// converged SQP against the best known cost. A time is the median over repetitions of one instance.
#include "solvers/sqp/sqp.hpp"

#include "tests/support/tracking_sqp.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>

namespace {

using namespace solenoid;
using test::TrackingSlide;
using Clock = std::chrono::steady_clock;

constexpr int repetitions = 51;

double us(Clock::duration d) { return std::chrono::duration<double, std::micro>(d).count(); }

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

void print(const char* name, const std::vector<double>& values) {
  const double median = quantile(values, 0.5), worst = quantile(values, 1.0);
  std::printf("%-44s median %7.1f  p99 %7.1f  worst %7.1f us (%.2f x median)\n", name, median, quantile(values, 0.99),
              worst, worst / median);
}

struct Iteration {
  double prepare_us, feedback_us, whole_us;
};

/// Medians of one real-time iteration from `guess`.
Iteration real_time_iteration(RelaxedSolver<TrackingSlide>& sqp, const Problem<TrackingSlide>& problem,
                              const RelaxedPlan<TrackingSlide>& guess) {
  std::vector<double> prepare, feedback, whole;
  RelaxedPlan<TrackingSlide> plan = guess;
  for (int i = 0; i < repetitions; ++i) {
    plan = guess;
    const auto begin = Clock::now();
    sqp.anticipate(problem, plan);
    const auto middle = Clock::now();
    sqp.solve(problem, plan, Deadline::never());
    const auto end = Clock::now();
    prepare.push_back(us(middle - begin)), feedback.push_back(us(end - middle)), whole.push_back(us(end - begin));
  }
  return {quantile(prepare, 0.5), quantile(feedback, 0.5), quantile(whole, 0.5)};
}

void print(const char* name, const std::vector<Iteration>& all) {
  std::vector<double> prepare, feedback, whole;
  for (const Iteration& one : all)
    prepare.push_back(one.prepare_us), feedback.push_back(one.feedback_us), whole.push_back(one.whole_us);
  std::printf("%s\n", name);
  print("    anticipated", prepare);
  print("    solve, one iteration", feedback);
  print("    one real-time iteration", whole);
}

}  // namespace

int main() {
  const auto all = test::recorded_nlps();
  const RelaxedGrid grid = control_grid(all[0].problem.horizon, 1);
  const auto sqp = std::make_unique<Sqp<TrackingSlide, 2, 0>>();
  const auto once = std::make_unique<Sqp<TrackingSlide, 2, 0>>(SqpSettings{.max_iterations = 1});
  sqp->prepare(all[0].problem, grid);
  once->prepare(all[0].problem, grid);
  std::vector<Iteration> cold, follow;
  std::vector<double> converged, iterations;
  int reached = 0;
  for (const auto& one : all) {
    const RelaxedPlan<TrackingSlide> middle(one.problem, grid);
    cold.push_back(real_time_iteration(*once, one.problem, middle));
    RelaxedPlan<TrackingSlide> plan = middle;
    std::vector<double> times;
    SolveReport report;
    for (int i = 0; i < repetitions; ++i) {
      plan = middle;
      report = sqp->solve(one.problem, plan, Deadline::never());
      times.push_back(report.time_us);
    }
    converged.push_back(quantile(times, 0.5));
    iterations.push_back(static_cast<double>(report.nodes));
    const bool good = report.cost <= one.best_known_cost * (1.0 + 1e-3);
    reached += good;
    if (!good || report.status != Status::optimal)
      std::printf("  %s: cost %.9g, best known %.9g (%+.2e), %d iterations\n",
                  std::string(to_string(report.status)).c_str(), report.cost, one.best_known_cost,
                  report.cost / one.best_known_cost - 1.0, static_cast<int>(report.nodes));
    // The next period's iteration: from the converged plan one stage on.
    std::copy(plan.weights.begin() + static_cast<std::ptrdiff_t>(plan.modes), plan.weights.end(), plan.weights.begin());
    std::copy(plan.continuous.begin() + 1, plan.continuous.end(), plan.continuous.begin());
    follow.push_back(real_time_iteration(*once, one.problem, plan));
  }
  std::printf("%zu recorded relaxed programs, N = 20\n", all.size());
  print("from duties one half, no force", cold);
  print("from a converged plan shifted by one stage", follow);
  print("SQP to convergence", converged);
  std::printf("    iterations: median %.0f, worst %.0f; within 1e-3 of the best known cost: %d of %zu\n",
              quantile(iterations, 0.5), quantile(iterations, 1.0), reached, all.size());
}
