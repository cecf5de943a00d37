// What is written once for every system, on two that are not the actuator: shell, predictive controller, filter, exit,
// loop and simulated plant, in closed loop.

#include "controllers/controller_shell.hpp"
#include "controllers/estimators/kalman_estimator.hpp"
#include "controllers/mpc_controller.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "core/systems/inverter/modes.hpp"
#include "core/systems/thrusters/bang_off_bang.hpp"
#include "core/systems/thrusters/modes.hpp"
#include "experiments/plants/simulated_model.hpp"
#include "solvers/search/branch_and_bound.hpp"

#include <bit>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

constexpr double thruster_tick_s = 0.01;

/// Three axes, the outputs being their values and then their rates.
const std::vector<OutputSource> pose_and_rates = {{0, 0}, {1, 0}, {2, 0}, {0, 1}, {1, 1}, {2, 1}};

/// The pose with its noise; nothing measures the rates.
std::vector<KalmanChannel<FreeFlyer>> pose_channels() {
  return {KalmanChannel<FreeFlyer>::of(0, 1e-3), KalmanChannel<FreeFlyer>::of(1, 1e-3),
          KalmanChannel<FreeFlyer>::of(2, 1e-3)};
}

KalmanSetup<FreeFlyer> flyer_setup(bool with_disturbances) {
  KalmanSetup<FreeFlyer> setup;
  setup.channels = pose_channels();
  setup.process_sigma = {0, 0, 0, 1e-3, 1e-3, 2e-3};
  setup.start_sigma = {0.01, 0.01, 0.01, 0.01, 0.01, 0.01};
  if (!with_disturbances) return setup;
  for (std::size_t k = 3; k < 6; ++k) {  // accelerations, unknown and nearly constant
    KalmanDisturbance<FreeFlyer> d{.sigma = 0.02, .drift = 1e-3};
    d.states[k] = 1.0;
    setup.disturbances.push_back(d);
  }
  return setup;
}

template <HybridModel M>
Problem<M> flyer_problem(const M& model, const ModeSet& modes) {
  Cost<M> cost;
  cost.tracking = {10, 10, 3, 10, 10, 3};
  cost.terminal = {200, 200, 60, 200, 200, 60};
  cost.consumption = 20.0;
  return {model, modes, Horizon{thruster_tick_s, {10, 10, 20, 20, 30}}, cost};
}

struct FlyerRun {
  std::vector<TickRecord> ticks;
  double fuel_kg = 0.0;
  /// Mean of an axis's error over the last half.
  double mean_error(std::size_t axis) const {
    double sum = 0.0;
    const std::size_t from = ticks.size() / 2;
    for (std::size_t k = from; k < ticks.size(); ++k)
      sum += ticks[k].decision.reference.axis[axis].value - ticks[k].sensors.truth[axis];
    return sum / static_cast<double>(ticks.size() - from);
  }
};

/// M: FreeFlyer, or that with disturbances held.
template <HybridModel M, class Inputs>
FlyerRun fly(const FreeFlyerParameters& truth, const Motion& motion, const KalmanSetup<FreeFlyer>& setup,
             const M& model, Inputs inputs, double duration_s) {
  const ModeSet modes = thruster_modes("single", FreeFlyerParameters());
  using Mpc = MpcController<M, Inputs>;
  Mpc mpc({flyer_problem(model, modes),
           std::make_unique<BranchAndBound<M>>(),
           {},
           {},
           0,
           10,
           pose_and_rates,
           std::move(inputs)});
  ControllerShell<Mpc> controller(
      {RestartableReference(motion), Estimator(KalmanEstimator<FreeFlyer>(FreeFlyer(), setup, thruster_tick_s)), modes,
       thruster_tick_s},
      std::move(mpc));
  SimulatedModel<FreeFlyer> plant(FreeFlyer(truth), modes, {}, thruster_tick_s,
                                  {.channels = pose_channels(), .seed = 3});
  CommandLimits limits(modes, {});
  const auto ticks = static_cast<std::int64_t>(duration_s / thruster_tick_s);
  MemoryRecorder recorder(static_cast<std::size_t>(ticks));
  FakeClock clock;
  ControlLoop loop(plant, clock, controller, limits, recorder);
  loop.run(ticks, thruster_tick_s);
  EXPECT_EQ(limits.refused(), 0);
  return {recorder.records(), plant.consumed()};
}

TEST(AnySystem, AFreeFlyerGoesFromRestToRest) {
  const Motion motion(
      {Trajectory(0.0).step_to(0.5, 20.0), Trajectory(0.0).step_to(0.3, 20.0), Trajectory(0.0).step_to(1.0, 20.0)});
  const FlyerRun run =
      fly(FreeFlyerParameters(), motion, flyer_setup(false), FreeFlyer(), PlannedInputs<FreeFlyer>(), 20.0);
  const StateValues& end = run.ticks.back().sensors.truth;
  EXPECT_NEAR(end[0], 0.5, 0.03);
  EXPECT_NEAR(end[1], 0.3, 0.03);
  EXPECT_NEAR(end[2], 1.0, 0.06);
  int solves = 0;
  for (const TickRecord& t : run.ticks) {
    solves += t.decision.solved;
    if (!t.decision.solved) continue;
    ASSERT_EQ(t.decision.report.status, Status::optimal) << t.sensors.time_s;
  }
  EXPECT_EQ(solves, 200);
  // No law can use less than the bang-off-bang of the whole way with one thruster all the time in the right direction.
  const FreeFlyerParameters p;
  const BangOffBang least = bang_off_bang(std::hypot(0.5, 0.3), p.thrust_n / p.mass_kg, 20.0);
  EXPECT_GT(run.fuel_kg, least.fuel_kg(p.flow_kg_per_s));
  EXPECT_LT(run.fuel_kg, 0.3);
}

TEST(AnySystem, AForceThatIsEstimatedLeavesNoOffset) {
  FreeFlyerParameters pushed;
  pushed.external_force_x_n = 2.0;
  pushed.external_force_y_n = -1.0;
  pushed.external_torque_nm = 0.1;
  const Motion station({Trajectory(0.0), Trajectory(0.0), Trajectory(0.0)});
  const FlyerRun blind = fly(pushed, station, flyer_setup(false), FreeFlyer(), PlannedInputs<FreeFlyer>(), 40.0);
  const KalmanSetup<FreeFlyer> setup = flyer_setup(true);
  const FlyerRun knowing =
      fly(pushed, station, setup, WithDisturbance<FreeFlyer>(), HeldDisturbances<FreeFlyer>(setup.disturbances), 40.0);
  const FreeFlyerParameters p;
  const EstimateDetail& found = knowing.ticks.back().decision.detail;
  EXPECT_NEAR(found.belief[0], 2.0 / p.mass_kg, 2e-3);
  EXPECT_NEAR(found.belief[1], -1.0 / p.mass_kg, 2e-3);
  EXPECT_LT(std::hypot(knowing.mean_error(0), knowing.mean_error(1)),
            0.5 * std::hypot(blind.mean_error(0), blind.mean_error(1)));
}

constexpr int inverter_ticks = 1600;  // two periods of 20 ms

/// A rotating current of rated amplitude, in phase with the electromotive force.
Motion rated_current(const InverterParameters& p) {
  std::vector<double> times, alpha, beta;
  for (int k = 0; k <= inverter_ticks; ++k) {
    const double angle = 2 * std::numbers::pi * p.emf_frequency_hz * k * p.sampling_s;
    times.push_back(k * p.sampling_s);
    alpha.push_back(p.rated_current_a * std::cos(angle));
    beta.push_back(p.rated_current_a * std::sin(angle));
  }
  return Motion({Trajectory(alpha[0]).through(times, alpha), Trajectory(beta[0]).through(times, beta)});
}

/// Two periods with blocks of one tick each, under ideal sensing.
std::vector<TickRecord> drive(std::size_t blocks, double switching) {
  const InverterParameters p;
  const InverterLoad model(p);
  const ModeSet modes = inverter_modes("three_level", p);
  Cost<InverterLoad> cost;
  cost.tracking = {1.0, 1.0};
  cost.switching = switching;
  using Mpc = MpcController<InverterLoad>;
  Mpc mpc({Problem<InverterLoad>(model, modes, Horizon{p.sampling_s, std::vector<int>(blocks, 1)}, cost),
           std::make_unique<BranchAndBound<InverterLoad>>(),
           {},
           {},
           0,
           1,
           {{0, 0}, {1, 0}},
           {}});
  const auto emf = model.emf(0.0);
  SimulatedModel<InverterLoad> plant(model, modes, {p.rated_current_a, 0.0, emf[0], emf[1]}, p.sampling_s,
                                     {.channels = {}, .ideal = true});
  KalmanSetup<InverterLoad> unused;
  unused.channels = {KalmanChannel<InverterLoad>::of(0, 1.0)};
  ControllerShell<Mpc> controller(
      {RestartableReference(rated_current(p)), Estimator(KalmanEstimator<InverterLoad>(model, unused, p.sampling_s)),
       modes, p.sampling_s},
      std::move(mpc));
  CommandLimits limits(modes, {});
  MemoryRecorder recorder(inverter_ticks);
  FakeClock clock;
  ControlLoop loop(plant, clock, controller, limits, recorder);
  loop.run(inverter_ticks, p.sampling_s);
  EXPECT_EQ(loop.counts().skipped, 0);
  EXPECT_EQ(limits.refused(), 0);
  return recorder.records();
}

TEST(AnySystem, AnInvertersCurrentFollowsATickOf25MicrosecondsAtATime) {
  const InverterParameters p;
  const SwitchTiming timing(inverter_modes("three_level", p), p.sampling_s);
  for (const auto& [blocks, switching] : {std::pair{1, 600.0}, std::pair{3, 3500.0}}) {
    const std::vector<TickRecord> ticks = drive(static_cast<std::size_t>(blocks), switching);
    ASSERT_EQ(ticks.size(), static_cast<std::size_t>(inverter_ticks));
    double squares = 0.0;
    int changes = 0;
    SwitchPattern last = 0;
    for (const TickRecord& t : ticks) {
      EXPECT_TRUE(t.decision.solved);
      EXPECT_TRUE(DelayLines(last).may_command(t.applied.switches, timing)) << t.sensors.time_s;
      for (std::size_t a = 0; a < 2; ++a)
        squares += std::pow(t.decision.reference.axis[a].value - t.sensors.truth[a], 2);
      changes += std::popcount(last ^ t.applied.switches);
      last = t.applied.switches;
    }
    // Around 300 Hz a device (twelve of them, two changes a cycle) the ripple is some 5 % of the current's amplitude.
    const double seconds = inverter_ticks * p.sampling_s;
    EXPECT_NEAR(changes / (12 * seconds), 300.0, 100.0);
    EXPECT_LT(std::sqrt(squares / inverter_ticks) / p.rated_current_a, 0.1);
  }
}

}  // namespace
}  // namespace solenoid
