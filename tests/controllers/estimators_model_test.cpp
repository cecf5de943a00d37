#include "controllers/catalogue.hpp"
#include "controllers/estimators/forecast.hpp"
#include "controllers/estimators/sensitivity.hpp"
#include "controllers/systems/actuator/estimators/moving_horizon.hpp"
#include "core/systems/actuator/signals.hpp"
#include "tests/support/drawn_world.hpp"

#include <cmath>
#include <random>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using Core = StateOf<LoadedActuator>;

/// States away from the kinks of the physics, where a derivative exists on both sides.
Core smooth_state(std::mt19937_64& random) {
  const auto between = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  const double speed = between(0.05, 0.4);
  return {between(0.01, 0.1),     between(0, 1) < 0.5 ? -speed : speed,
          between(1.4e5, 1.85e5), between(1.4e5, 1.85e5),
          between(-5, 5),         between(0, 0.4),
          between(0.8, 1.2),      between(0.7, 2)};
}

TEST(EstimatorModel, SensitivitiesAgreeWithFiniteDifferences) {
  std::mt19937_64 random(7);
  const LoadedActuator model(PneumaticActuator(), {});
  const Core scale = {1e-6, 1e-6, 1.0, 1.0, 1e-3, 1e-6, 1e-6, 1e-6};
  for (int trial = 0; trial < 200; ++trial) {
    const Core x = smooth_state(random);
    const Vector<double, 4> opening = trial % 2 ? Vector<double, 4>{1, 0, 0, 1} : Vector<double, 4>{0, 1, 1, 0};
    SensedModel::Jacobian jacobian;
    const Core value = linearise(model, x, opening, {2.0}, actuator_timing.tick_s, jacobian);
    EXPECT_EQ(value, model.step<double>(x, opening, {2.0}, actuator_timing.tick_s));
    for (std::size_t j = 0; j < 8; ++j) {
      Core up = x, down = x;
      up[j] += scale[j], down[j] -= scale[j];
      const Core a = model.step<double>(up, opening, {2.0}, actuator_timing.tick_s),
                 b = model.step<double>(down, opening, {2.0}, actuator_timing.tick_s);
      for (std::size_t i = 0; i < 8; ++i) {
        const double difference = (a[i] - b[i]) / (2 * scale[j]);
        const double exact = jacobian(static_cast<int>(i), static_cast<int>(j));
        EXPECT_NEAR(exact, difference, 1e-4 * std::abs(exact) + 1e-9 * std::abs(x[i]) / scale[j] + 1e-7)
            << i << "," << j;
      }
    }
  }
}

TEST(EstimatorModel, SensitivityOfFillFlowIsFiniteAtAndAboveSupplyPressure) {
  const ActuatorParameters p;
  for (const double over : {0.0, 5e4}) {
    SensedModel::Jacobian jacobian;
    linearise(LoadedActuator(PneumaticActuator(p), {}), {0.05, 0.1, p.supply_pressure_pa + over, 1.5e5, 0, 0, 1, 1},
              {1, 0, 0, 1}, {0.0}, actuator_timing.tick_s, jacobian);
    EXPECT_TRUE(jacobian.allFinite());
    EXPECT_NEAR(jacobian(pressure_a, flow_factor), 0.0, 1e-12);  // of a head that is none
  }
}

TEST(EstimatorModel, ALoadSetAfterwardsIsTheParametersOwn) {
  ActuatorParameters loaded;
  loaded.payload_mass_kg = 0.23;
  PneumaticActuator changed;
  changed.set_load(0.23, 3.0);
  const PneumaticActuator built(loaded);
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 100; ++trial) {
    const Core x = smooth_state(random);
    const ActuatorState state = {x[0], x[1], x[2], x[3]};
    const auto a = changed.step<double>(state, {1, 0, 0, 1}, {1.0}, actuator_timing.tick_s);
    const auto b =
        built.step<double>(state, {1, 0, 0, 1}, {4.0}, actuator_timing.tick_s);  // the external force as the motor's
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(a[i], b[i], 1e-13 * std::max(1.0, std::abs(b[i])));
  }
  EXPECT_DOUBLE_EQ(changed.parameters().payload_mass_kg, 0.23);
}

TEST(PressureLag, FollowsTheBesselFilterBetweenTicks) {
  const PressureLag lag(50.0, actuator_timing.tick_s);
  Bessel8 fine(50.0, 100e3);
  std::array<double, PressureLag::size> z{};
  const auto c = lag.output();
  fine.reset(0.0);
  double before = 0.0, worst = 0.0;
  for (int k = 1; k <= 400; ++k) {
    const double after = std::sin(0.15 * k) + 0.5 * std::sin(0.37 * k) + 0.01 * k;
    double filtered = 0.0, modelled = 0.0;
    for (int i = 1; i <= 100; ++i) filtered = fine.step(before + (after - before) * i / 100);
    lag.advance<1>(z.data(), &before, &after);
    for (std::size_t i = 0; i < z.size(); ++i) modelled += c[i] * z[i];
    worst = std::max(worst, std::abs(filtered - modelled));
    before = after;
  }
  EXPECT_LT(worst, 1e-3);
}

TEST(SensedModel, PropagatesCovariancesAsItsDenseJacobianWould) {
  const SensedModel model{PneumaticActuator(), EstimatorTuning()};
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  SensedModel::Jacobian jacobian;
  double unknown = 0.0;
  Belief::State mean = Belief::State::Zero();
  const Core x = smooth_state(random);
  std::copy(x.begin(), x.end(), mean.data());
  model.linearise(mean, 1e-3, {1, 0, 0, 1}, 1.0, jacobian, unknown);
  Eigen::Matrix<double, Belief::size, Belief::size, Eigen::RowMajor> dense;
  dense.setIdentity();
  model.propagate<Belief::size>(jacobian, dense.data());
  Belief::Covariance root;
  for (int i = 0; i < root.size(); ++i) root.data()[i] = normal(random);
  const Belief::Covariance p = root * root.transpose();
  Belief::Covariance fast = p;
  model.propagate<Belief::size>(jacobian, fast.data());
  fast.transposeInPlace();
  model.propagate<Belief::size>(jacobian, fast.data());
  const Belief::Covariance exact = dense * p * dense.transpose();
  EXPECT_LT((fast - exact).norm(), 1e-10 * exact.norm());
}

TEST(Forecast, IsThePlantItselfWhenModelAndInputsAgree) {
  const PneumaticActuator model;
  const ModeSet modes = valve_modes("three_way", ActuatorParameters());
  const SwitchTiming timing(modes, actuator_timing.tick_s);
  DelayLines lines(0);
  lines.command(3, timing);
  ActuatorState plant = {0.05, 0.1, 1.5e5, 1.4e5};
  const ActuatorState start = plant;
  DelayLines moving = lines;
  const auto commanded = [](int j) -> SwitchPattern { return j < 2 ? 3 : 1; };  // a plan that goes on meanwhile
  for (int j = 0; j < 7; ++j) {
    lines.command(commanded(j), timing);
    Vector<double, 4> opening;
    std::ranges::copy(modes.point(lines.effective()), opening.begin());
    plant = model.step<double>(plant, opening, {0.5 * j}, actuator_timing.tick_s);
    lines.advance(1);
  }
  const auto ahead = forecast(model, modes, timing, start, moving, 7, actuator_timing.tick_s, commanded,
                              [](int j, const ActuatorState&) { return Vector<double, 1>{0.5 * j}; });
  EXPECT_EQ(ahead, plant);
  EXPECT_TRUE(moving == lines);
}

/// Runs `each(k, sensors, world)` along a drawn plant, with faults put into the sensors by `spoil`.
template <class F, class Spoil>
double worst_position_error(F& filter, int ticks, int from, const Spoil& spoil) {
  DrawnWorld world(moderate_tuning(), 11);
  double worst = 0.0;
  for (int k = 0; k < ticks; ++k) {
    Measurement s = world.sensors();
    const Measurement sound = s;
    spoil(k, s);
    const ActuatorState x = filter.update(s);
    if (k >= from) worst = std::max(worst, std::abs(x[position] - world.truth()[position]));
    world.advance(sound);
    filter.applied(world.opening(), world.motor_n());
  }
  return worst;
}

TEST(ActuatorKalman, BridgesMissingSensorsAndRefusesSpikes) {
  ActuatorKalman filter(PneumaticActuator(), moderate_tuning());
  const double worst = worst_position_error(filter, 3000, 0, [](int k, Measurement& s) {
    if (k % 97 < 5 && k > 0) s.value[position_channel] = std::nan("");
    if (k % 53 == 52) s.value[pressure_a_channel] = std::nan("");
    if (k % 211 == 210) s.value[position_channel] += 0.01;
  });
  EXPECT_LT(worst, 0.3e-3);
  EXPECT_EQ(filter.starts(), 1);
}

TEST(ActuatorKalman, StartsAnewWhenPositionsContradictItForLong) {
  ActuatorKalman filter(PneumaticActuator(), moderate_tuning());
  // A potentiometer that slips by 5 mm and back: after each slip the belief must follow, not argue.
  const double worst = worst_position_error(filter, 3000, 2600, [](int k, Measurement& s) {
    if (k >= 1500 && k < 2400) s.value[position_channel] += 5e-3;
  });
  EXPECT_LT(worst, 0.2e-3);
}

TEST(ActuatorKalman, KeepsItsCovariancePositive) {
  ActuatorKalman filter(PneumaticActuator(), moderate_tuning());
  worst_position_error(filter, 8000, 0, [](int, Measurement&) {});
  const Belief::Covariance& p = filter.belief().covariance;
  EXPECT_EQ((p - p.transpose()).norm(), 0.0);
  const Belief::State scale = p.diagonal().cwiseSqrt().cwiseInverse();
  const Belief::Covariance correlation = scale.asDiagonal() * p * scale.asDiagonal();
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Belief::Covariance>(correlation).eigenvalues().minCoeff(), -1e-10);
}

TEST(MovingHorizon, DescendsOnItsCostAndStaysWithTheTruth) {
  MovingHorizon estimator(PneumaticActuator(), moderate_tuning());
  DrawnWorld world(moderate_tuning(), 4);
  double squares = 0.0;
  int descents = 0;
  for (int k = 0; k < 3000; ++k) {
    const Measurement s = world.sensors();
    const ActuatorState x = estimator.update(s);
    ASSERT_LE(estimator.cost(), estimator.cost_at_arrival()) << k;
    descents += estimator.cost() < estimator.cost_at_arrival();
    squares += std::pow(x[position] - world.truth()[position], 2);
    world.advance(s);
    estimator.applied(world.opening(), world.motor_n());
  }
  EXPECT_GT(descents, 2900);
  EXPECT_LT(std::sqrt(squares / 3000), 0.02e-3);
}

TEST(MovingHorizon, FurtherIterationsFindNothingBetter) {
  EstimatorTuning two = moderate_tuning(), five = two;
  two.iterations = 2, five.iterations = 5;
  MovingHorizon a(PneumaticActuator(), two), b(PneumaticActuator(), five);
  DrawnWorld world(two, 9);
  double excess = 0.0, total = 0.0;
  for (int k = 0; k < 1500; ++k) {
    const Measurement s = world.sensors();
    a.update(s), b.update(s);
    excess += a.cost() - b.cost(), total += b.cost();
    world.advance(s);
    a.applied(world.opening(), world.motor_n()), b.applied(world.opening(), world.motor_n());
  }
  EXPECT_LT(excess, 0.002 * total);
}

TEST(Estimator, RefusesAnUnknownName) {
  EXPECT_THROW(make_estimator("luenberger", PneumaticActuator(), EstimatorTuning()), std::invalid_argument);
}

}  // namespace
}  // namespace solenoid
