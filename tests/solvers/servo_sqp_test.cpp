// SQP without a switch: continuous openings of servo valves, judged by the relaxed cost's own differences.
#include "core/systems/actuator/servo_actuator.hpp"
#include "core/systems/actuator/valves.hpp"
#include "solvers/sqp/sqp.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// Without dry friction the smooth physics are the exact ones but for what rounds off the valves' null.
ActuatorParameters slippery() {
  ActuatorParameters p;
  p.static_friction_n = p.coulomb_friction_n = 0.0;
  return p;
}

template <HybridModel M>
Problem<M> lifting(const M& model, double motor_n) {
  Cost<M> cost{.tracking = {1.0, 0.0}, .terminal = {10.0, 0.02}, .consumption = 1e-4, .continuous = {1e-9, 1e-7, 1e-7}};
  Bounds<M> bounds;
  bounds.continuous_lower = {-motor_n, -1.0, -1.0};
  bounds.continuous_upper = {motor_n, 1.0, 1.0};
  Problem<M> problem(model, valve_modes(servo_valves, model.parameters()), Horizon{0.001, std::vector<int>(60, 1)},
                     cost, bounds);
  problem.initial = {0.04, 0.05, 1.6e5, 1.65e5, 0.1, 0.0, -0.1, 0.0};
  for (std::size_t j = 0; j < problem.reference.size(); ++j) {
    const double t = 0.001 * static_cast<double>(j + 1);
    problem.reference[j] = {0.04 + 0.05 * t + 0.4 * t * t, 0.05 + 0.8 * t};
  }
  if constexpr (HasFeedback<M>) problem.setpoint = problem.reference;
  return problem;
}

/// What is left of the cost's gradient in the bounds' interior and against them, in units of the inputs' ranges.
template <HybridModel M>
double kkt_residual(const Problem<M>& problem, const RelaxedGrid& grid, const RelaxedPlan<M>& plan) {
  double worst = 0.0;
  const auto cost = [&](const RelaxedPlan<M>& at) {
    RelaxedPlan<M> copy = at;
    return relaxed_cost<M, Dynamics::smoothed>(problem, grid, copy);
  };
  for (std::size_t k = 0; k < grid.size(); ++k)
    for (std::size_t i = 0; i < M::continuous_size; ++i) {
      const double low = problem.bounds.continuous_lower[i], high = problem.bounds.continuous_upper[i];
      if (!(low < high)) continue;
      const double range = (high - low) / 2, h = 1e-5 * range;
      RelaxedPlan<M> up = plan, down = plan;
      up.continuous[k][i] += h, down.continuous[k][i] -= h;
      const double slope = (cost(up) - cost(down)) / (2 * h) * range, at = plan.continuous[k][i];
      const bool on_low = at - low < 1e-6 * range, on_high = high - at < 1e-6 * range;
      worst = std::max(worst, on_low ? -slope : on_high ? slope : std::abs(slope));
    }
  return worst;
}

template <HybridModel M>
void expect_first_order_point(const M& model, double motor_n) {
  const Problem<M> problem = lifting(model, motor_n);
  ASSERT_EQ((transcription_sizes(problem)), (std::array{0, 0}));
  const RelaxedGrid grid = control_grid(problem.horizon, 0, 5);
  Sqp<M, 0, 0> sqp({.max_iterations = 200, .tolerance = 1e-11});
  sqp.prepare(problem, grid);
  RelaxedPlan<M> plan(problem, grid);
  const double at_first = kkt_residual(problem, grid, plan), cost_at_first = relaxed_cost(problem, grid, plan);
  const SolveReport report = sqp.solve(problem, plan, Deadline::never());
  EXPECT_TRUE(report.status == Status::optimal || report.status == Status::feasible) << to_string(report.status);
  EXPECT_EQ(report.cost, relaxed_cost(problem, grid, plan));
  EXPECT_LT(report.cost, 0.2 * cost_at_first);
  const double left = kkt_residual(problem, grid, plan);
  EXPECT_LT(left, 1e-5 * at_first);
  for (const auto& u : plan.continuous)
    for (std::size_t i = 0; i < M::continuous_size; ++i) {
      EXPECT_GE(u[i], problem.bounds.continuous_lower[i] - 1e-9);
      EXPECT_LE(u[i], problem.bounds.continuous_upper[i] + 1e-9);
    }
  std::printf("  %s, cost %.3g of %.3g, gradient %.3g of %.3g\n", std::string(to_string(report.status)).c_str(),
              report.cost, cost_at_first, left, at_first);
}

TEST(ServoSqp, ReachesAFirstOrderPoint) {
  expect_first_order_point(ServoActuator(slippery()), 0.0);
  expect_first_order_point(ServoActuator(slippery()), 7.0);  // inside of what the model saturates itself
  expect_first_order_point(PrestabilisedServo(slippery(), {2000.0, 40.0}), 0.0);
}

TEST(ServoSqp, FullOpeningsWhereTheReferenceIsOutOfReach) {
  const ServoActuator model(slippery());
  auto problem = lifting(model, 0.0);
  for (auto& r : problem.reference) r = {0.11, 0.0};
  const RelaxedGrid grid = control_grid(problem.horizon, 0, 5);
  Sqp<ServoActuator, 0, 0> sqp;
  sqp.prepare(problem, grid);
  RelaxedPlan<ServoActuator> plan(problem, grid);
  EXPECT_TRUE(usable(sqp.solve(problem, plan, Deadline::never()).status));
  EXPECT_NEAR(plan.continuous[0][opening_a_input], 1.0, 1e-6);   // fills A
  EXPECT_NEAR(plan.continuous[0][opening_b_input], -1.0, 1e-6);  // and empties B
}

TEST(ServoSqp, RealTimeIterationsTakeTheMeasuredStateIn) {
  const ServoActuator model(slippery());
  const auto problem = lifting(model, 0.0);
  const RelaxedGrid grid = control_grid(problem.horizon, 0, 5);
  Sqp<ServoActuator, 0, 0> whole({.max_iterations = 100}), single({.max_iterations = 1});
  whole.prepare(problem, grid), single.prepare(problem, grid);
  RelaxedPlan<ServoActuator> best(problem, grid), plan(problem, grid);
  const SolveReport converged = whole.solve(problem, best, Deadline::never());
  auto forecast = problem;
  forecast.initial[position] += 2e-5, forecast.initial[opening_a] += 0.02;
  SolveReport report;
  for (int i = 0; i < 12; ++i) {
    single.anticipate(i == 0 ? forecast : problem, plan);
    report = single.solve(problem, plan, Deadline::never());
    EXPECT_TRUE(report.anticipated);
  }
  EXPECT_NEAR(report.cost, converged.cost, 5e-3 * converged.cost);
}

}  // namespace
}  // namespace solenoid
