// The reference solver: recorded programs, the fishing problem's published optimum, derivatives, statuses, threads.
#include "solvers/nlp/relaxed_ipopt.hpp"
#include "tests/support/lotka_volterra.hpp"
#include "tests/support/tracking_nlp.hpp"

#include <thread>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using test::TrackingSlide;
using SlideIpopt = RelaxedIpopt<TrackingSlide, 2, 0>;

struct IpoptOutcome {
  SolveReport report;
  RelaxedPlan<TrackingSlide> plan;
};

IpoptOutcome solved_by_ipopt(const Problem<TrackingSlide>& problem, const nlp::IpoptSettings& settings = {},
                             Deadline deadline = Deadline::never(), int starts = 1) {
  const RelaxedGrid grid = control_grid(problem.horizon, 1);
  SlideIpopt solver(settings, starts);
  solver.prepare(problem, grid);
  IpoptOutcome outcome{{}, RelaxedPlan<TrackingSlide>(problem, grid)};
  outcome.report = solver.solve(problem, outcome.plan, deadline);
  return outcome;
}

/// minimise (z0 - 2)^2 + exp(z1)  s.t.  z0^2 + z1^2 <= 1 (or = 9 with z in a unit box: infeasible)
class Circle final : public nlp::Program {
 public:
  explicit Circle(double low, double high) {
    lower = {-1.0, -1.0}, upper = {1.0, 1.0}, g_lower = {low}, g_upper = {high};
    jacobian = {{0, 0}, {0, 1}};
    hessian = {{0, 0}, {1, 1}};
  }
  double objective(std::span<const double> z) override { return (z[0] - 2) * (z[0] - 2) + std::exp(z[1]); }
  void gradient(std::span<const double> z, std::span<double> out) override {
    out[0] = 2 * (z[0] - 2), out[1] = std::exp(z[1]);
  }
  void constraints(std::span<const double> z, std::span<double> out) override { out[0] = z[0] * z[0] + z[1] * z[1]; }
  void jacobian_values(std::span<const double> z, std::span<double> out) override {
    out[0] = 2 * z[0], out[1] = 2 * z[1];
  }
  void hessian_values(std::span<const double> z, double factor, std::span<const double> lambda,
                      std::span<double> out) override {
    out[0] = 2 * factor + 2 * lambda[0], out[1] = factor * std::exp(z[1]) + 2 * lambda[0];
  }
};

TEST(Ipopt, RecordedProgramsReachTheBestKnownCost) {
  int reached = 0, usable_count = 0;
  for (const auto& one : test::recorded_nlps()) {
    // Where one start ends in a local minimum, others may not.
    IpoptOutcome outcome = solved_by_ipopt(one.problem);
    if (outcome.report.cost > one.best_known_cost * 1.001)
      outcome = solved_by_ipopt(one.problem, {}, Deadline::never(), 5);
    usable_count += usable(outcome.report.status);
    reached += outcome.report.cost <= one.best_known_cost * 1.001;
    if (outcome.report.cost > one.best_known_cost * 1.001 || !usable(outcome.report.status))
      std::printf("  %s: %.9g against %.9g (%+.1e), %d iterations\n",
                  std::string(to_string(outcome.report.status)).c_str(), outcome.report.cost, one.best_known_cost,
                  outcome.report.cost / one.best_known_cost - 1.0, static_cast<int>(outcome.report.nodes));
  }
  std::printf("  within 1e-3: %d, usable: %d\n", reached, usable_count);
  EXPECT_EQ(usable_count, 100);
  EXPECT_GE(reached, 98);  // two end in local minima that the flow's jumps make
}

TEST(Ipopt, FishingReachesTheRelaxedOptimum) {
  const auto problem = fishing_problem(0.005, std::vector<int>(600, 4));
  const RelaxedGrid grid = control_grid(problem.horizon, 0);
  RelaxedIpopt<LotkaVolterraFishing, 1, 0> solver;
  solver.prepare(problem, grid);
  RelaxedPlan<LotkaVolterraFishing> plan(problem, grid);
  const SolveReport report = solver.solve(problem, plan, Deadline::never());
  EXPECT_EQ(report.status, Status::optimal);
  EXPECT_NEAR(fishing_integral(problem, plan.outputs), 1.34408, 1e-5);
}

TEST(IpoptStatus, OptimalAtAClosedForm) {
  Circle circle(-HUGE_VAL, 1.0);
  std::vector<double> z = {0.1, 0.1};
  EXPECT_EQ(nlp::solve_with_ipopt(circle, z, {}, Deadline::never()).status, Status::optimal);
  // On the circle, angle t: d/dt ((cos t - 2)^2 + exp(sin t)) = 0.
  const double t = std::atan2(z[1], z[0]);
  EXPECT_NEAR(z[0] * z[0] + z[1] * z[1], 1.0, 1e-7);
  EXPECT_NEAR(-2 * (z[0] - 2) * std::sin(t) + std::exp(z[1]) * std::cos(t), 0.0, 1e-6);
}

TEST(IpoptStatus, Infeasible) {
  Circle circle(9.0, 9.0);
  std::vector<double> z = {0.1, 0.1};
  EXPECT_EQ(nlp::solve_with_ipopt(circle, z, {}, Deadline::never()).status, Status::infeasible);
}

TEST(IpoptStatus, IterationLimitDeadlineAndNumericalFailure) {
  const auto recorded = test::recorded_nlps();
  EXPECT_EQ(solved_by_ipopt(recorded[3].problem, {.max_iterations = 1}).report.status, Status::iteration_limit);
  EXPECT_EQ(solved_by_ipopt(recorded[3].problem, {}, Deadline::after(std::chrono::nanoseconds(0))).report.status,
            Status::deadline_reached);
  auto problem = recorded[3].problem;
  problem.initial[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(solved_by_ipopt(problem).report.status, Status::numerical_failure);
}

TEST(Ipopt, TwoThreadsTakeTurns) {
  const auto recorded = test::recorded_nlps();
  const double alone = solved_by_ipopt(recorded[7].problem).report.cost;
  std::vector<double> costs(2);
  {
    std::jthread one([&] { costs[0] = solved_by_ipopt(recorded[7].problem).report.cost; });
    std::jthread two([&] { costs[1] = solved_by_ipopt(recorded[7].problem).report.cost; });
  }
  EXPECT_EQ(costs[0], alone);
  EXPECT_EQ(costs[1], alone);
}

}  // namespace
}  // namespace solenoid
