#include "controllers/estimators/offset_free.hpp"

#include "controllers/estimators/extended_kalman.hpp"
#include "controllers/estimators/observability.hpp"
#include "core/systems/actuator/prestabilised.hpp"
#include "core/systems/actuator/signals.hpp"
#include "solvers/search/branch_and_bound.hpp"
#include "solvers/search/exhaustive.hpp"
#include "tests/support/double_integrator.hpp"
#include "tests/support/uniform.hpp"

#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

constexpr double without_end = std::numeric_limits<double>::infinity();

TEST(KalmanObservability, SaysWhatDisturbancesChannelsTellApart) {
  KalmanSetup<DoubleIntegrator> setup;
  const auto of = [&] { return observability<DoubleIntegrator>({}, setup, {}, {1.0}, {}, 0.01); };
  setup.channels = {KalmanChannel<DoubleIntegrator>::of(0, 0.1)};
  EXPECT_TRUE(of().observable() && of().detectable());
  setup.disturbances = {{.states = {0, 1}, .sigma = 1.0}};  // a force, seen in the position
  EXPECT_TRUE(of().observable() && of().detectable());
  EXPECT_EQ(of().rank, 3);

  setup.disturbances.push_back({.channels = {1.0}, .sigma = 1.0});  // two of one channel: one too many
  EXPECT_FALSE(of().observable() || of().detectable());
  EXPECT_EQ(of().rank, 3);
  EXPECT_NEAR(of().persisting, 1.0, 1e-9);
  setup.disturbances.back().memory_s = 1.0;  // an offset that fades differs from a position
  EXPECT_TRUE(of().observable());
  setup.disturbances.back() = {.sigma = 1.0, .memory_s = 1.0};  // nobody sees it, and it fades
  EXPECT_TRUE(of().detectable());
  EXPECT_FALSE(of().observable());
  EXPECT_NEAR(of().persisting, std::exp(-0.01), 1e-9);

  setup.disturbances = {{.states = {0, 1}, .sigma = 1.0}};
  setup.channels = {KalmanChannel<DoubleIntegrator>::of(1, 0.1)};  // of the velocity alone
  EXPECT_FALSE(of().detectable());
}

TEST(KalmanObservability, SeesTheActuatorsForceFromPositionAndPressures) {
  using M = PneumaticActuator;
  KalmanSetup<M> setup;
  setup.channels = {KalmanChannel<M>::of(position, 3e-5), KalmanChannel<M>::of(pressure_a, 100.0, 0.0, 10),
                    KalmanChannel<M>::of(pressure_b, 100.0, 0.0, 10)};
  setup.disturbances = {{.states = {0.0, 1.0}, .sigma = 2.0}};
  const auto of = [&] {
    return observability(M(), setup, {0.05, 0.1, 1.5e5, 1.6e5}, {1, 0, 0, 1}, {0.0}, actuator_timing.tick_s);
  };
  EXPECT_TRUE(of().observable());
  setup.disturbances.push_back({.channels = {0.0, 1.0}, .sigma = 1e3});  // each sensor may have an offset of its own
  setup.disturbances.push_back({.channels = {0.0, 0.0, 1.0}, .sigma = 1e3});
  setup.disturbances.push_back({.channels = {1.0}, .sigma = 1e-3});
  EXPECT_FALSE(of().detectable());
}

static_assert(HybridModel<WithDisturbance<PrestabilisedActuator>> &&
              HasFeedback<WithDisturbance<PrestabilisedActuator>>);
static_assert(HasConsumption<WithDisturbance<PneumaticActuator>> && HasSmoothStep<WithDisturbance<PneumaticActuator>>);
static_assert(HasEnclosure<WithDisturbance<PneumaticActuator>> && HasStateScale<WithDisturbance<PneumaticActuator>>);
static_assert(!HasFeedback<WithDisturbance<PneumaticActuator>> && HasEnclosure<WithDisturbance<DoubleIntegrator>>);
static_assert(!HasSmoothStep<WithDisturbance<DoubleIntegrator>> && !HasStateScale<WithDisturbance<DoubleIntegrator>>);

TEST(OffsetFreeModel, AddsWhatIsHeldToStepsAndOutputsAndNothingElse) {
  const PrestabilisedActuator own;
  WithDisturbance<PrestabilisedActuator> model(own);
  const ActuatorState x = {0.05, 0.1, 1.5e5, 1.6e5};
  const Vector<double, 4> s = {1, 0, 0, 1};
  EXPECT_EQ(model.step<double>(x, s, {1.0}, actuator_timing.tick_s),
            own.step<double>(x, s, {1.0}, actuator_timing.tick_s));
  const ActuatorState rate = {0.0, 2.0, -3e4, 1e4};
  model.set_disturbance(rate, {1e-3, 0.02});
  const auto stepped = model.step<double>(x, s, {1.0}, actuator_timing.tick_s),
             before = own.step<double>(x, s, {1.0}, actuator_timing.tick_s);
  const auto smooth = model.smooth_step<double>(x, s, {1.0}, actuator_timing.tick_s),
             smooth_before = own.smooth_step<double>(x, s, {1.0}, actuator_timing.tick_s);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(stepped[i], before[i] + actuator_timing.tick_s * rate[i]);
    EXPECT_EQ(smooth[i], smooth_before[i] + actuator_timing.tick_s * rate[i]);
  }
  EXPECT_EQ(model.output<double>(x), (Vector<double, 2>{0.05 + 1e-3, 0.1 + 0.02}));
  EXPECT_EQ(model.consumption<double>(x, s), own.consumption<double>(x, s));
  EXPECT_EQ(model.state_scale(), own.state_scale());
  // A law that is told to hold the output where it is has nothing to do.
  EXPECT_NEAR(model.feedback<double>(x, model.output<double>(x))[0], 0.0, 1e-9);
}

TEST(OffsetFreeModel, EnclosesTheStepsOfABox) {
  WithDisturbance<PrestabilisedActuator> model;
  model.set_disturbance({0.0, 3.0, -3e4, 1e4}, {1e-3, 0.0});
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const ActuatorState middle = {uniform(random, 0.03, 0.08), uniform(random, -0.3, 0.3), uniform(random, 1.2e5, 3e5),
                                  uniform(random, 1.2e5, 3e5)};
    const ActuatorState half = {1e-3, 0.05, 5e3, 5e3};
    ActuatorState low, high, x;
    for (std::size_t i = 0; i < 4; ++i) {
      low[i] = middle[i] - half[i], high[i] = middle[i] + half[i];
      x[i] = uniform(random, low[i], high[i]);
    }
    const Vector<double, 4> none = {0, 0, 0, 0}, all = {1, 1, 1, 1}, s = {1, 0, 0, 1};
    const Vector<double, 2> setpoint = {0.05, 0.0};
    model.enclose_step<double>(low, high, none, all, setpoint, {0.0}, actuator_timing.tick_s);
    const auto next = model.step<double>(x, s, model.feedback<double>(x, setpoint), actuator_timing.tick_s);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_GE(next[i], low[i] - 1e-9 * std::abs(low[i])) << i;
      EXPECT_LE(next[i], high[i] + 1e-9 * std::abs(high[i])) << i;
    }
  }
}

/// A heated room above the temperature outside, T x' = s - x with s in {0, 1}, under a held s.
struct HeatedRoom {
  static constexpr std::size_t state_size = 1, switched_size = 1, continuous_size = 0, output_size = 1;
  static constexpr double time_constant_s = 1.0;

  template <class S>
  Vector<S, 1> step(const Vector<S, 1>& x, const Vector<S, 1>& s, const Vector<S, 0>&, double dt) const {
    const double kept = std::exp(-dt / time_constant_s);
    return {S(kept) * x[0] + S(1 - kept) * s[0]};
  }
  template <class S>
  Vector<S, 1> output(const Vector<S, 1>& x) const {
    return x;
  }
};

/// How a run settles: over its second half the mean of output less setpoint, half the way between the output's extremes
/// (the limit cycle's amplitude), and the mean of what the last state is believed to gain per second.
struct SettledRun {
  double mean_error, amplitude, rate;
};

/// A plant with a constant disturbance under a search that is told the filter's estimate of state and, if it has one,
/// disturbance; each control period of `period` ticks the plan's first mode is applied.
template <HybridModel M, template <HybridModel> class Search>
SettledRun track_setpoint(const ModeSet& modes, const KalmanSetup<M>& setup, double dt, std::vector<int> blocks,
                          Cost<M> weights, const StateOf<M>& disturbance_rate, double setpoint) {
  using Believed = WithDisturbance<M>;
  Cost<Believed> cost;
  cost.tracking = weights.tracking;
  Problem<Believed> problem(Believed(), modes, {dt, blocks}, cost);
  for (auto& r : problem.reference) r[0] = setpoint;
  Search<Believed> search;
  search.prepare(problem);
  Plan<Believed> plan(problem);
  const SwitchTiming timing(modes, dt);
  ExtendedKalman<M> filter({}, setup, dt);
  std::mt19937_64 random(1);
  WithDisturbance<M> plant;
  plant.set_disturbance(disturbance_rate);
  StateOf<M> x = setup.start;
  constexpr int ticks = 6000, settled = 3000;
  double sum = 0.0, rate = 0.0, lowest = without_end, highest = -without_end;
  for (int k = 0; k < ticks; ++k) {
    const double measured = x[0] + setup.channels[0].sigma * std::normal_distribution<double>()(random);
    problem.initial = filter.update(std::span(&measured, 1));
    problem.model.set_disturbance(filter.disturbance_rate());
    if (k % blocks[0] == 0) {
      search.solve(problem, plan, Deadline::never());
      problem.lines.command(modes.pattern(plan.modes[0]), timing);
    }
    SwitchedOf<M> s;
    std::ranges::copy(modes.point(problem.lines.effective()), s.begin());
    filter.applied(s, {});
    x = plant.template step<double>(x, s, {}, dt);
    problem.lines.advance(1);
    if (k < ticks - settled) continue;
    sum += (x[0] - setpoint) / settled;
    rate += filter.disturbance_rate().back() / settled;
    lowest = std::min(lowest, x[0]), highest = std::max(highest, x[0]);
  }
  return {sum, (highest - lowest) / 2, rate};
}

TEST(OffsetFreeTracking, ARoomWithAColdWindowMissesItsSetpointUntilTheFilterLearnsOfIt) {
  KalmanSetup<HeatedRoom> setup;
  setup.channels = {KalmanChannel<HeatedRoom>::of(0, 0.002)};
  setup.process_sigma = {0.005};
  setup.start_sigma = {0.1};
  Cost<HeatedRoom> cost;
  cost.tracking = {1.0};
  const auto run = [&] {
    return track_setpoint<HeatedRoom, Exhaustive>({"heater", {{"heater"}}, {{"off", 0}, {"on", 1}}, {0.0}, {{1.0}}},
                                                  setup, 0.01, {2, 2, 2, 4, 8, 8}, cost, {-0.5}, 0.25);
  };
  const SettledRun ignorant = run();
  setup.disturbances = {{.states = {1.0}, .sigma = 0.5, .drift = 0.01}};
  const SettledRun informed = run();
  std::printf("room: mean error %.5f without a disturbance state, %.5f with; limit cycle %.5f\n", ignorant.mean_error,
              informed.mean_error, informed.amplitude);
  EXPECT_LT(ignorant.mean_error, -2 * informed.amplitude);
  EXPECT_LT(std::abs(informed.mean_error), 0.25 * informed.amplitude);
  EXPECT_NEAR(informed.rate, -0.5, 0.01);
}

TEST(OffsetFreeTracking, ADoubleIntegratorUnderAConstantForceMissesItsSetpointUntilTheFilterLearnsOfIt) {
  KalmanSetup<DoubleIntegrator> setup;
  setup.channels = {KalmanChannel<DoubleIntegrator>::of(0, 0.001)};
  setup.process_sigma = {0.0, 0.1};
  setup.start_sigma = {0.1, 0.1};
  Cost<DoubleIntegrator> cost;
  // A search that is told the truth settles at a mean error of -0.0027 itself, since its horizon is finite.
  cost.tracking = {1.0, 0.1};
  const auto run = [&] {
    return track_setpoint<DoubleIntegrator, BranchAndBound>(bang_bang(), setup, 0.02, {2, 2, 2, 2, 4, 4, 8, 8}, cost,
                                                            {0.0, 0.4}, 0.5);
  };
  const SettledRun ignorant = run();
  setup.disturbances = {{.states = {0.0, 1.0}, .sigma = 0.5, .drift = 0.02}};
  const SettledRun informed = run();
  std::printf("integrator: mean error %.5f without a disturbance state, %.5f with; limit cycle %.5f\n",
              ignorant.mean_error, informed.mean_error, informed.amplitude);
  EXPECT_GT(ignorant.mean_error, informed.amplitude);
  EXPECT_LT(std::abs(informed.mean_error), 0.5 * informed.amplitude);
  EXPECT_NEAR(informed.rate, 0.4, 0.01);
}

}  // namespace
}  // namespace solenoid
