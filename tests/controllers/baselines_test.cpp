// The literature's controllers against their own equations: duties and bounds, surfaces and modes, phases, costs.
#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "controllers/systems/actuator/laws/extended_cost.hpp"
#include "controllers/systems/actuator/laws/pulse_width_pid.hpp"
#include "controllers/systems/actuator/laws/switching_hybrid.hpp"
#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"
#include "solvers/search/exhaustive.hpp"
#include "tests/support/law_scene.hpp"
#include "tests/support/variant_text.hpp"

#include <bit>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using Scene = test::LawScene;

PulseWidthSettings silent() {
  PulseWidthSettings s;
  s.proportional = s.integral = s.derivative = s.feedforward = s.friction = 0.0;
  return s;
}
PulseWidthPid law_of(const PulseWidthSettings& s) {
  return {s, valve_modes("three_way", ActuatorParameters()), actuator_timing.tick_s};
}

TEST(PulseWidthPid, DutyIsTheSumOfItsTerms) {
  Scene scene;
  scene.state[position] = 0.048;
  scene.state[velocity] = -0.01;
  PulseWidthSettings s = silent();
  s.proportional = 20.0, s.derivative = 3.0, s.integral = 5.0, s.friction = 0.04, s.period_ticks = 10;
  // 20 * 2 mm + 3 * 10 mm/s + 5 * 2 mm * 10 ms + friction against an error beyond the band
  EXPECT_NEAR(law_of(s).duty(scene.at(0)), 0.04 + 0.03 + 1e-4 + 0.04, 1e-12);
  s.friction_band_m = 3e-3;  // now the error is left alone
  EXPECT_NEAR(law_of(s).duty(scene.at(0)), 0.04 + 0.03 + 1e-4, 1e-12);
}

TEST(PulseWidthPid, FeedforwardIsTheComingChangeOfTheDesiredPosition) {
  Scene scene;
  scene.reference = RestartableReference(Trajectory(0.02).cycloid_to(0.08, 1.0));
  PulseWidthSettings s = silent();
  s.feedforward = 12.0, s.lead_s = 0.07;
  PulseWidthPid law = law_of(s);
  for (const std::int64_t tick : {0, 300, 500, 960, 1200}) {
    const double t = 1e-3 * static_cast<double>(tick);
    const double coming = scene.reference.at(t + 0.07).axis[0].value - scene.reference.at(t).axis[0].value;
    EXPECT_NEAR(law.duty(scene.at(tick)), 12.0 * coming, 1e-12);
  }
  s.friction = 0.1;  // along the motion, whatever the sign of the error
  EXPECT_NEAR(law_of(s).duty(scene.at(500)) - law_of([&] {
                                                auto none = s;
                                                none.friction = 0.0;
                                                return none;
                                              }())
                                                  .duty(scene.at(500)),
              0.1, 1e-12);
}

TEST(PulseWidthPid, IntegralStaysInItsBoundsAndComesBackAtOnce) {
  Scene scene;
  scene.state[position] = 0.0;  // 50 mm of error
  PulseWidthSettings s = silent();
  s.integral = 40.0, s.integral_limit = 0.25, s.period_ticks = 10;
  PulseWidthPid law = law_of(s);
  for (int k = 0; k < 1000; ++k) {
    const double before = law.integral();
    law.duty(scene.at(10 * k));
    EXPECT_NEAR(law.integral(), std::min(before + 40.0 * 0.05 * 0.01, 0.25), 1e-12);
  }
  scene.state[position] = 0.1;  // the error turns: no wind-up to work off
  law.duty(scene.at(0));
  EXPECT_NEAR(law.integral(), 0.25 - 40.0 * 0.05 * 0.01, 1e-12);
}

/// Mean time in effect of either valve over many periods at a constant u, and the coil edges.
struct Means {
  double a = 0.0, b = 0.0;
  int edges = 0;
};
Means means_at(double u, const PulseWidthSettings& base, int periods) {
  Scene scene;
  scene.state[position] = 0.05 - u;
  PulseWidthSettings s = base;
  s.proportional = 1.0;
  PulseWidthPid law = law_of(s);
  const ModeSet modes = valve_modes("three_way", ActuatorParameters());
  const SwitchTiming timing(modes, 1e-3);
  DelayLines lines(0);
  Means m;
  const int ticks = periods * s.period_ticks;
  for (int k = 0; k < ticks; ++k) {
    const SwitchPattern pattern = law.coils(scene.at(k));
    m.edges += std::popcount(pattern ^ lines.commanded());
    lines.command(pattern, timing);
    m.a += lines.effective() & 1u, m.b += (lines.effective() >> 1) & 1u;
    lines.advance(1);
  }
  m.a /= ticks, m.b /= ticks;
  return m;
}

TEST(PulseWidthPid, ValvesAreInEffectForTheirDutiesDespiteTheirDelays) {
  PulseWidthSettings s = silent();
  for (const int period : {10, 16, 20})
    for (const double u : {-0.93, -0.6, -0.31, -0.05, 0.0, 0.05, 0.2, 0.47, 0.6, 0.85}) {
      s.period_ticks = period;
      const Means m = means_at(u, s, 500);
      EXPECT_NEAR(m.a, 0.5 + 0.5 * u, 0.01) << period << ' ' << u;
      EXPECT_NEAR(m.b, 0.5 - 0.5 * u, 0.01) << period << ' ' << u;
      EXPECT_LE(m.edges, 4 * 500);  // at most a pulse a valve and period
    }
  for (const double u : {-1.0, 1.0}) {
    const Means m = means_at(u, s, 200);
    EXPECT_NEAR(m.a, 0.5 + 0.5 * u, 0.01);
    EXPECT_LE(m.edges, 1);
  }
}

TEST(ThreeModeSliding, SurfaceIsTheErrorsSecondOrderPolynomial) {
  Scene scene;
  scene.state = {0.049, -0.02, 131325.0, 101325.0};
  scene.motor_n = 2.0;
  const SlidingSettings settings{.frequency = 50.0, .damping = 0.7, .dead_band_m = 1e-4};
  const ThreeModeSliding law(settings, valve_modes("three_mode", ActuatorParameters()));
  const double force = scene.model.cylinder_force(131325.0, 101325.0) + 2.0;
  const double acceleration = force / scene.model.parameters().equivalent_mass_kg();
  EXPECT_NEAR(law.surface(scene.at(0)), -acceleration / 2500.0 + 2 * 0.7 / 50.0 * 0.02 + 0.001, 1e-9);
}

TEST(ThreeModeSliding, SignAndDeadBandChooseTheMode) {
  const SlidingSettings settings{.dead_band_m = 2e-4};
  for (const char* valves : {"three_mode", "seven_mode", "two_way"}) {
    const ModeSet modes = valve_modes(valves, ActuatorParameters());
    const ThreeModeSliding law(settings, modes);
    const auto opening = [&](double s) {
      const auto point = modes.point(law.mode(s));
      return std::vector<double>(point.begin(), point.end());
    };
    using testing::ElementsAre;
    for (const double s : {2.1e-4, 1e-2}) {
      EXPECT_THAT(opening(s), ElementsAre(1, 0, 0, 1)) << valves;   // A fills, B exhausts
      EXPECT_THAT(opening(-s), ElementsAre(0, 1, 1, 0)) << valves;  // the reverse
    }
    for (const double s : {0.0, 1.9e-4, -1.9e-4}) EXPECT_THAT(opening(s), ElementsAre(0, 0, 0, 0)) << valves;
  }
}

TEST(ThreeModeSliding, DecidesEveryNthTickAndHoldsInBetween) {
  Scene scene;
  ThreeModeSliding law({.dead_band_m = 1e-4, .every_ticks = 5}, valve_modes("three_mode", ActuatorParameters()));
  scene.state[position] = 0.04;
  const SwitchPattern push = law.coils(scene.at(0));
  scene.state[position] = 0.06;
  for (int k = 1; k < 5; ++k) EXPECT_EQ(law.coils(scene.at(k)), push);
  EXPECT_NE(law.coils(scene.at(5)), push);
}

TEST(SwitchingHybrid, PhasesChangeWithHysteresis) {
  Scene scene;
  SwitchingHybrid law({.coarse_above_m = 3e-4, .fine_below_m = 1e-4}, {.dead_band_m = 1e-6, .every_ticks = 5},
                      valve_modes("two_way", ActuatorParameters()));
  const auto coarse_at = [&](std::int64_t tick, double error_m) {
    scene.state[position] = 0.05 - error_m;
    const SwitchPattern coils = law.coils(scene.at(tick));
    EXPECT_EQ(coils != 0, law.coarse()) << error_m;  // any such error is beyond the sliding mode's dead band
    return law.coarse();
  };
  EXPECT_FALSE(coarse_at(0, 2.9e-4));  // the motor has it
  EXPECT_TRUE(coarse_at(1, 3.1e-4));   // the cylinder comes in, at once
  EXPECT_TRUE(coarse_at(2, 2e-4));     // and stays between the thresholds
  EXPECT_TRUE(coarse_at(3, -2e-4));
  EXPECT_FALSE(coarse_at(4, 0.9e-4));
  EXPECT_FALSE(coarse_at(5, -2.9e-4));
  EXPECT_TRUE(coarse_at(6, -3.1e-4));
}

TEST(SwitchingHybrid, AtRestTheChambersAreClosedOrOpenToTheAir) {
  const ModeSet modes = valve_modes("two_way", ActuatorParameters());
  Scene scene;
  SwitchingHybrid closed({}, {}, modes), open({.rest = "exhaust"}, {}, modes);
  EXPECT_EQ(closed.coils(scene.at(0)), 0u);
  const auto point = modes.point(open.coils(scene.at(0)));
  EXPECT_THAT(std::vector<double>(point.begin(), point.end()), testing::ElementsAre(0, 1, 0, 1));
}

Problem<PneumaticActuator> tracking_problem(const char* valves, std::vector<int> blocks) {
  Cost<PneumaticActuator> cost;
  cost.tracking = {1.0, 1e-4};
  cost.terminal = {30.0, 0.02};
  cost.switching = 3e-8;
  cost.consumption = 1e-4;
  const PneumaticActuator model;
  Problem<PneumaticActuator> problem(model, valve_modes(valves, model.parameters()), {1e-3, std::move(blocks)}, cost);
  problem.initial = {0.045, 0.03, 160e3, 140e3};
  problem.lines = DelayLines(0);
  for (std::size_t j = 0; j < problem.reference.size(); ++j) {
    const double t = 1e-3 * static_cast<double>(j + 1);
    problem.reference[j] = {0.046 + 0.05 * t + t * t, 0.05 + 2 * t};  // accelerates at 2 m/s2
  }
  return problem;
}

TEST(ExtendedCost, IsTheSumOneCanDoByHand) {
  const auto problem = tracking_problem("three_mode", {10, 20});
  constexpr double weight = 1e-6;
  ExtendedCostSearch<PneumaticActuator> solver(weight);
  solver.prepare(problem);
  const Plan<PneumaticActuator> plan(problem);
  const PneumaticActuator& model = problem.model;
  for (int mode = 0; mode < 3; ++mode) {
    // Coils one by one: 4 ms to open, 1 ms to close, closed again from the tenth step on.
    const auto on = problem.modes.point(problem.modes.pattern(mode));
    ActuatorState x = problem.initial;
    const int switches = mode == 0 ? 0 : 4;
    double cost = 3e-8 * switches, error = 0, slip = 0;
    for (int j = 0; j < 30; ++j) {
      Vector<double, 4> opening{};
      for (std::size_t i = 0; i < 4; ++i) opening[i] = j >= 4 && j < 11 ? on[i] : 0.0;
      cost += 1e-4 * 1e-3 * model.consumption<double>(x, opening);
      x = model.step<double>(x, opening, {0.0}, 1e-3);
      const double t = 1e-3 * (j + 1);
      error = 0.046 + 0.05 * t + t * t - x[position], slip = 0.05 + 2 * t - x[velocity];
      cost += error * error + 1e-4 * slip * slip;
    }
    cost += 30.0 * error * error + 0.02 * slip * slip;
    const ActuatorParameters& p = model.parameters();
    const double force = model.cylinder_force(x[pressure_a], x[pressure_b]) + model.gravity_force(x[position]) -
                         model.sliding_friction(x[velocity], x[velocity] > 0 ? 1.0 : -1.0);
    cost += weight * std::pow(2.0 - force / p.equivalent_mass_kg(), 2);
    EXPECT_NEAR(solver.cost_of_mode(problem, plan, mode), cost, 1e-9 * cost) << mode;
  }
}

TEST(ExtendedCost, ChoosesTheLeastAndClosesAfterwards) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  auto problem = tracking_problem("three_mode", {10, 30});
  ExtendedCostSearch<PneumaticActuator> solver(1e-6);
  solver.prepare(problem);
  Plan<PneumaticActuator> plan(problem);
  std::set<int> chosen;
  for (int trial = 0; trial < 60; ++trial) {
    problem.initial[position] = 0.045 + 0.01 * unit(random);
    problem.lines = DelayLines(problem.modes.pattern(trial % 3));
    const SolveReport report = solver.solve(problem, plan, Deadline::never());
    ASSERT_EQ(report.status, Status::optimal);
    EXPECT_EQ(report.cost, solver.cost_of_mode(problem, plan, plan.modes[0]));
    EXPECT_EQ(report.bound, report.cost);
    for (int mode = 0; mode < 3; ++mode) EXPECT_LE(report.cost, solver.cost_of_mode(problem, plan, mode));
    EXPECT_EQ(problem.modes.pattern(plan.modes[1]), 0u);
    chosen.insert(plan.modes[0]);
  }
  EXPECT_EQ(chosen.size(), 3u);
}

TEST(ExtendedCost, WithoutItsOwnTermAndWithOneBlockItIsExhaustiveSearch) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (const char* valves : {"three_mode", "three_way", "two_way"}) {
    auto problem = tracking_problem(valves, {40});
    ExtendedCostSearch<PneumaticActuator> solver(0.0);
    Exhaustive<PneumaticActuator> oracle;
    solver.prepare(problem);
    oracle.prepare(problem);
    Plan<PneumaticActuator> plan(problem), best(problem);
    for (int trial = 0; trial < 30; ++trial) {
      problem.initial = {0.046 + 0.01 * unit(random), 0.1 * unit(random), 150e3 + 40e3 * unit(random), 150e3};
      const SolveReport mine = solver.solve(problem, plan, Deadline::never());
      const SolveReport least = oracle.solve(problem, best, Deadline::never());
      EXPECT_EQ(mine.cost, least.cost) << valves;
      EXPECT_EQ(plan.modes, best.modes) << valves;
    }
  }
}

TEST(ExtendedCost, SaysHowItEnded) {
  auto problem = tracking_problem("three_mode", {10, 30});
  ExtendedCostSearch<PneumaticActuator> solver(1e-6);
  solver.prepare(problem);
  Plan<PneumaticActuator> plan(problem);
  EXPECT_EQ(solver.solve(problem, plan, Deadline(Deadline::Clock::now())).status, Status::deadline_reached);
  problem.initial[velocity] = std::nan("");
  EXPECT_EQ(solver.solve(problem, plan, Deadline::never()).status, Status::numerical_failure);
  problem.initial[velocity] = 0.03;
  problem.bounds.state_upper[position] = 0.04;
  EXPECT_EQ(solver.solve(problem, plan, Deadline::never()).status, Status::infeasible);
  EXPECT_THROW(solver.prepare(tracking_problem("three_way", {10, 30})), std::invalid_argument);
}

TEST(LawVariants, AreReadWithTheirTables) {
  const VariantConfig v = test::variant_of(
      "valves = 'two_way'\nsolver = 'switching_hybrid'\nmotor = 'pd'\nestimator = 'ekf'\n"
      "sliding = { frequency = 40.0, dead_band_m = 2e-4, every_ticks = 2 }\n"
      "phases = { coarse_above_m = 5e-4, rest = 'exhaust' }\n");
  EXPECT_TRUE(v.is_feedback_law());
  EXPECT_EQ(actuator(v).sliding.frequency, 40.0);
  EXPECT_EQ(actuator(v).sliding.every_ticks, 2);
  EXPECT_EQ(actuator(v).phases.rest, "exhaust");
  EXPECT_EQ(actuator(test::variant_of("solver = 'pulse_width_pid'\npulse_width = { bias = 0.4 }")).pulse_width.bias,
            0.4);
  const VariantConfig extended =
      test::variant_of("valves = 'three_mode'\nsolver = 'extended_cost'\ncost = { terminal_acceleration = 2.0 }");
  EXPECT_EQ(actuator(extended).terminal_acceleration, 2.0);
}

TEST(LawVariants, RefuseWhatTheyCannotUse) {
  using testing::AllOf;
  using testing::HasSubstr;
  const auto says = [](const char* key, const char* allowed) {
    return AllOf(HasSubstr("mine.toml"), HasSubstr(key), HasSubstr(allowed));
  };
  EXPECT_THAT(test::refusal_of("solver = 'pulse_width_pid'\nvalves = 'two_way'"),
              says("'valves'", "allowed: three_way"));
  EXPECT_THAT(test::refusal_of("solver = 'three_mode_sliding'"), says("'valves'", "two_way, three_mode, seven_mode"));
  EXPECT_THAT(test::refusal_of("solver = 'three_mode_sliding'\nvalves = 'three_mode'\nhorizon = { steps = 50 }"),
              says("'horizon'", "allowed"));
  EXPECT_THAT(test::refusal_of("solver = 'three_mode_sliding'\nvalves = 'three_mode'\nsliding = { frequency = 0.0 }"),
              says("'sliding.frequency'", "allowed: a number > 0"));
  EXPECT_THAT(test::refusal_of("solver = 'switching_hybrid'\nvalves = 'three_mode'"),
              says("'motor'", "pd, inverse_dynamics"));
  EXPECT_THAT(test::refusal_of("solver = 'switching_hybrid'\nvalves = 'three_mode'\nmotor = 'in_prediction'"),
              says("'motor'", "none, pd, inverse_dynamics"));
  EXPECT_THAT(test::refusal_of(
                  "solver = 'switching_hybrid'\nvalves = 'three_mode'\nmotor = 'pd'\nphases = { fine_below_m = 1.0 }"),
              says("'phases.fine_below_m'", "0 to 0.0003"));
  EXPECT_THAT(test::refusal_of(
                  "solver = 'switching_hybrid'\nvalves = 'three_mode'\nmotor = 'pd'\nphases = { rest = 'exhaust' }"),
              says("'valves'", "allowed: two_way"));
  EXPECT_THAT(test::refusal_of("solver = 'pulse_width_pid'\npulse_width = { period_ticks = 2 }"),
              says("'pulse_width.period_ticks'", "5"));
  EXPECT_THAT(test::refusal_of("solver = 'extended_cost'\nhorizon = { steps = 20, blocks = [1, 3] }"),
              says("'valves'", "three_mode"));
  EXPECT_THAT(test::refusal_of("cost = { terminal_acceleration = 1.0 }"), says("terminal_acceleration", "allowed"));
}

}  // namespace
}  // namespace solenoid
