// Relaxed plans under modulators: what is planned for twice when the prediction does not know the modulator, and
// promises.
#include "core/systems/actuator/prestabilised.hpp"
#include "core/systems/actuator/valves.hpp"
#include "solvers/rounding/projected_gradient.hpp"
#include "solvers/rounding/relax_and_pulse.hpp"
#include "tests/support/double_integrator.hpp"
#include "tests/support/uniform.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

constexpr double dt_s = 0.01;
constexpr Modulation every_modulation[] = {Modulation::pulse_width, Modulation::delta_sigma, Modulation::delta_sigma_2,
                                           Modulation::dynamic_quantiser};

Problem<DoubleIntegrator> integrator_problem(const ModeSet& modes) {
  Cost<DoubleIntegrator> cost;
  cost.tracking = {1.0, 0.01}, cost.terminal = {10.0, 1.0};
  Bounds<DoubleIntegrator> bounds;
  bounds.continuous_lower = bounds.continuous_upper = {0.0};
  Problem<DoubleIntegrator> problem(DoubleIntegrator{}, modes, {dt_s, std::vector<int>(40, 1)}, cost, bounds);
  problem.lines = DelayLines(modes.pattern(0));
  return problem;
}

RelaxAndPulse<DoubleIntegrator> modulated_mpc(Modulation modulation, bool informed) {
  return {std::make_unique<ProjectedGradient<DoubleIntegrator>>(ProjectedGradientSettings{.most_iterations = 40}),
          {.interval = 5, .modulation = modulation, .informed = informed, .edge_price = 0.0}};
}

/// The root mean square of the position error behind a sine, five steps of each plan applied, the first fifty plans
/// left out.
double closed_loop_error(const ModeSet& modes, Modulation modulation, bool informed, double amplitude) {
  constexpr double rate = 2.0;
  auto problem = integrator_problem(modes);
  auto solver = modulated_mpc(modulation, informed);
  solver.prepare(problem);
  Plan<DoubleIntegrator> plan(problem);
  const SwitchTiming timing(modes, dt_s);
  double squares = 0.0;
  int count = 0;
  for (int k = 0; k < 250; ++k) {
    for (int j = 0; j < 40; ++j) {
      const double t = dt_s * (5 * k + j + 1);
      problem.reference[static_cast<std::size_t>(j)] = {amplitude * std::sin(rate * t),
                                                        amplitude * rate * std::cos(rate * t)};
    }
    EXPECT_TRUE(usable(solver.solve(problem, plan, Deadline::never()).status));
    for (std::size_t i = 0; i < 5; ++i) {
      const SwitchPattern pattern = modes.pattern(plan.modes[i]);
      EXPECT_TRUE(problem.lines.may_command(pattern, timing));
      problem.lines.command(pattern, timing);
      problem.initial =
          problem.model.step<double>(problem.initial, modes.inputs<1>(problem.lines.effective()), {0.0}, dt_s);
      problem.lines.advance(1);
      const double error = problem.initial[0] - problem.reference[i][0];
      if (k >= 50) squares += error * error, ++count;
    }
    shift_plan(problem.horizon, 5, plan);
  }
  return std::sqrt(squares / count);
}

TEST(Informed, IsNotWorseOnTheDoubleIntegratorWithOneSwitch) {
  for (const double amplitude : {0.0, 0.05, 0.1})
    for (const Modulation modulation :
         {Modulation::delta_sigma, Modulation::delta_sigma_2, Modulation::dynamic_quantiser}) {
      const auto error = [&](const ModeSet& modes, bool informed) {
        return closed_loop_error(modes, modulation, informed, amplitude);
      };
      const double uninformed = error(bang_bang(), false), informed = error(bang_bang(), true);
      std::printf("  %d at %.2f: %.3g informed, %.3g not\n", static_cast<int>(modulation), amplitude, informed,
                  uninformed);
      EXPECT_LE(informed, uninformed);
      if (modulation == Modulation::delta_sigma_2) continue;  // which delays leave little of
      EXPECT_LE(error(bang_bang(0.04, 0.01), true), error(bang_bang(0.04, 0.01), false));
    }
}

TEST(Informed, TheRelaxationBeginsWithWhatIsOwed) {
  /// Says what it was asked to plan for.
  struct Asked final : RelaxedSolver<DoubleIntegrator> {
    void prepare(const Problem<DoubleIntegrator>&, const RelaxedGrid&) override {}
    SolveReport solve(const Problem<DoubleIntegrator>& problem, RelaxedPlan<DoubleIntegrator>&,
                      Deadline) noexcept override {
      initial = problem.initial;
      SolveReport report;
      report.status = Status::feasible;
      return report;
    }
    StateOf<DoubleIntegrator> initial{};
  };
  const auto problem = [] {
    auto made = integrator_problem(bang_bang());
    made.initial = {0.3, -0.1};
    return made;
  }();
  for (const bool informed : {false, true}) {
    auto inside = std::make_unique<Asked>();
    const Asked& asked = *inside;
    RelaxAndPulse<DoubleIntegrator> solver(
        std::move(inside), {.interval = 5, .modulation = Modulation::delta_sigma_2, .informed = informed});
    solver.prepare(problem);
    Plan<DoubleIntegrator> plan(problem);
    plan.relaxation.known = true;
    for (std::size_t i = 0; i < plan.relaxation.weights.size(); ++i) plan.relaxation.weights[i] = 0.5;
    plan.relaxation.owed[0][0] = 0.4, plan.relaxation.owed_sum[0][0] = -1.5;
    solver.solve(problem, plan, Deadline::never());
    if (!informed) {
      EXPECT_EQ(asked.initial, problem.initial);
      continue;
    }
    // What is owed as the modulator makes up for it, 0.4 steps in all, sum k d_k = 1.5, ends where the relaxation does
    // that begins there and has nothing owed: the double integrator's (A - I)^2 is 0.
    const std::vector<double> owed = {-0.1, 0.0, 0.0, 0.5, 0.0, 0.0};
    StateOf<DoubleIntegrator> with = problem.initial, without = asked.initial;
    for (const double d : owed) {
      with = problem.model.step<double>(with, {2.0 * (0.5 + d) - 1.0}, {0.0}, dt_s);
      without = problem.model.step<double>(without, {2.0 * 0.5 - 1.0}, {0.0}, dt_s);
    }
    for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(with[i], without[i], 1e-12);
  }
}

TEST(ModulatedMpc, TheSameProblemAndWarmStartGiveTheSamePlan) {
  std::mt19937_64 random(5);
  for (const Modulation modulation : every_modulation)
    for (const bool informed : {false, true}) {
      auto used = modulated_mpc(modulation, informed), fresh = modulated_mpc(modulation, informed);
      auto problem = integrator_problem(bang_coast_bang(0.04, 0.01));
      used.prepare(problem), fresh.prepare(problem);
      Plan<DoubleIntegrator> plan(problem);
      for (int k = 0; k < 4; ++k) {
        problem.initial = {uniform(random, -0.1, 0.1), uniform(random, -0.1, 0.1)};
        used.solve(problem, plan, Deadline::never());
        shift_plan(problem.horizon, 5, plan);
      }
      Plan<DoubleIntegrator> again = plan;
      const SolveReport report = used.solve(problem, plan, Deadline::never());
      EXPECT_EQ(fresh.solve(problem, again, Deadline::never()).cost, report.cost);
      EXPECT_EQ(again.modes, plan.modes);
      EXPECT_EQ(again.relaxation.owed, plan.relaxation.owed);
      EXPECT_EQ(again.relaxation.owed_sum, plan.relaxation.owed_sum);
      EXPECT_EQ(report.cost, evaluate(problem, plan).cost);
    }
}

TEST(LinearPlant, IsTheModelsOwnWhereThatIsLinear) {
  auto problem = integrator_problem(bang_bang());
  LinearPlant plant = linear_plant(problem);
  linearise(problem, SwitchStates<double>{}, {0.0}, plant);
  EXPECT_EQ(plant.a, (std::vector<double>{1.0, dt_s, 0.0, 1.0}));
  EXPECT_EQ(plant.b, (std::vector<double>{2.0 * dt_s * dt_s / 2, 2.0 * dt_s}));  // off is -1, on is 1
  EXPECT_EQ(plant.c, (std::vector<double>{1.0, 0.0, 0.0, 1.0}));
  EXPECT_EQ(plant.weight, (std::vector<double>{40.0 + 10.0, 0.4 + 1.0}));
}

TEST(LinearPlant, HasTheDifferencesOfTheSmoothStepWithTheModelsFeedback) {
  const ActuatorParameters p;
  Cost<PrestabilisedActuator> cost;
  cost.tracking = {1.0, 0.0};
  Problem<PrestabilisedActuator> problem(PrestabilisedActuator(p, {}), valve_modes("two_way", p),
                                         {0.001, std::vector<int>(40, 1)}, cost);
  problem.initial = {0.05, 0.03, 2.1e5, 1.7e5};
  for (auto& r : problem.setpoint) r = {0.05001, 0.03};
  SwitchStates<double> at{};
  at[0] = 0.3, at[3] = 0.6;
  LinearPlant plant = linear_plant(problem);
  linearise(problem, at, {0.0}, plant);
  const auto stepped = [&](std::size_t i, double by) {
    auto moved = problem.initial;
    auto states = at;
    (i < 4 ? moved[i] : states[i - 4]) += by;
    predict_step<PrestabilisedActuator, Dynamics::smoothed, double>(
        problem, 0, switched_inputs<PrestabilisedActuator, double>(problem.modes, states), {0.0}, moved, [](double) {});
    return moved;
  };
  const double by[] = {1e-7, 1e-5, 1.0, 1.0, 1e-3, 1e-3, 1e-3, 1e-3};
  for (std::size_t i = 0; i < 8; ++i) {
    const auto up = stepped(i, by[i]), down = stepped(i, -by[i]);
    for (std::size_t k = 0; k < 4; ++k) {
      const double slope = (up[k] - down[k]) / (2.0 * by[i]);
      const double found = i < 4 ? plant.a[4 * k + i] : push(plant, k, i - 4);
      EXPECT_NEAR(found, slope, 1e-4 * std::abs(slope) + 1e-9) << k << " by " << i;
    }
  }
}

}  // namespace
}  // namespace solenoid
