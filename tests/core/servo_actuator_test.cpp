// The controllers' model on servo valves: its physics is the actuator's, and derivatives are what differences say.
#include "core/systems/actuator/servo_actuator.hpp"

#include <random>

#include <Eigen/Core>
#include <gtest/gtest.h>
#include <unsupported/Eigen/AutoDiff>

namespace solenoid {
namespace {

struct Drawn {
  Vector<double, 8> x;
  Vector<double, 3> u;
};

/// Moving slides away from the flow laws' jumps.
Drawn drawn(std::mt19937_64& random) {
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  return {{uniform(0.01, 0.1), uniform(-0.2, 0.2), uniform(1.4e5, 1.8e5), uniform(1.4e5, 1.8e5), uniform(-0.8, 0.8),
           uniform(-30, 30), uniform(-0.8, 0.8), uniform(-30, 30)},
          {uniform(-6, 6), uniform(-1, 1), uniform(-1, 1)}};
}

TEST(ServoActuator, StepIsTheActuatorsAtTheSpoolsMeanOpenings) {
  const ServoActuator model;
  const PneumaticActuator actuator;
  const double dt = 1e-3;
  const ServoValve& valve = model.parameters().servo;
  std::mt19937_64 random(7);
  for (int i = 0; i < 200; ++i) {
    const auto [x, u] = drawn(random);
    const auto next = model.step<double>(x, {}, u, dt);
    const SpoolStep spool(valve, dt);
    Vector<double, 4> opening{};
    for (std::size_t chamber = 0; chamber < 2; ++chamber) {
      const Spool after =
          Spool{x[opening_a + 2 * chamber], x[opening_a_rate + 2 * chamber], u[opening_a_input + chamber]}.after(spool);
      EXPECT_DOUBLE_EQ(next[opening_a + 2 * chamber], after.x);
      EXPECT_NEAR(next[opening_a_rate + 2 * chamber], after.v, 1e-12);
      const double mean = 0.5 * (x[opening_a + 2 * chamber] + after.x);
      opening[2 * chamber] = std::max(mean, 0.0), opening[2 * chamber + 1] = std::max(-mean, 0.0);
    }
    const auto own = actuator.step<double>({x[0], x[1], x[2], x[3]}, opening, {u[0]}, dt);
    for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(next[k], own[k], 1e-12 * (1 + std::abs(own[k])));
  }
}

TEST(ServoActuator, AnotherStepLengthIsRightToo) {
  const ServoActuator model({}, 1e-3);
  std::mt19937_64 random(8);
  const auto [x, u] = drawn(random);
  const auto half = model.step<double>(x, {}, u, 5e-4);
  const auto twice = model.step<double>(half, {}, u, 5e-4), whole = model.step<double>(x, {}, u, 1e-3);
  for (std::size_t k = opening_a; k < 8; ++k) EXPECT_NEAR(twice[k], whole[k], 1e-12 * (1 + std::abs(whole[k])));
}

TEST(ServoActuator, SmoothStepIsOffByNoMoreThanStatedInAnOpening) {
  const ServoActuator model;
  std::mt19937_64 random(9);
  double worst = 0.0;
  for (int i = 0; i < 2000; ++i) {
    auto [x, u] = drawn(random);
    if (i % 2) x[opening_a] = x[opening_a_rate] = u[opening_a_input] = 0.0;
    const auto exact = model.step<double>(x, {}, u, 1e-3), smooth = model.smooth_step<double>(x, {}, u, 1e-3);
    // What a half of the roundness in both paths can do to chamber A in a step.
    const double half = ServoActuator::null_roundness / 2;
    Vector<double, 8> shut = x;
    shut[opening_a] = shut[opening_a_rate] = 0.0;
    const auto still = model.step<double>(shut, {}, {u[0], 0.0, u[2]}, 1e-3);
    const auto open = model.step<double>(shut, {1.0, 0.0, 0.0, 0.0}, {u[0], 0.0, u[2]}, 1e-3);
    const auto exhausting = model.step<double>(shut, {0.0, 1.0, 0.0, 0.0}, {u[0], 0.0, u[2]}, 1e-3);
    const double most = half * (open[pressure_a] - still[pressure_a] - (exhausting[pressure_a] - still[pressure_a]));
    const double off = std::abs(smooth[pressure_a] - exact[pressure_a]);
    EXPECT_LE(off, most * (1 + 1e-9));
    worst = std::max(worst, off / most);
    EXPECT_EQ(smooth[opening_b], exact[opening_b]);
  }
  EXPECT_GT(worst, 0.01);
}

template <class Model>
void expect_derivatives_of(const Model& model) {
  using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, 11, 1>>;
  std::mt19937_64 random(10);
  const Vector<double, 11> size = {1e-5, 1e-4, 10, 10, 1e-4, 1e-2, 1e-4, 1e-2, 1e-3, 1e-4, 1e-4};
  for (int i = 0; i < 50; ++i) {
    const Drawn at = drawn(random);
    const auto step = [&]<class S>(const Vector<S, 8>& x, Vector<S, 3> u) {
      if constexpr (HasFeedback<Model>) {
        const auto law = model.template feedback<S>(x, {0.05, 0.0});
        for (std::size_t k = 0; k < 3; ++k) u[k] = u[k] + law[k];
      }
      return model.template smooth_step<S>(x, {S(0.0), S(0.0), S(0.0), S(0.0)}, u, 1e-3);
    };
    Vector<Dual, 8> x;
    Vector<Dual, 3> u;
    for (std::size_t k = 0; k < 8; ++k) x[k] = Dual(at.x[k], 11, static_cast<int>(k));
    for (std::size_t k = 0; k < 3; ++k) u[k] = Dual(at.u[k], 11, static_cast<int>(8 + k));
    const auto dual = step(x, u);
    for (std::size_t column = 0; column < 11; ++column) {
      Drawn up = at, down = at;
      (column < 8 ? up.x[column] : up.u[column - 8]) += size[column];
      (column < 8 ? down.x[column] : down.u[column - 8]) -= size[column];
      const auto above = step(up.x, up.u), below = step(down.x, down.u);
      const Vector<double, 8> scale = model.state_scale();
      for (std::size_t row = 0; row < 8; ++row) {
        const double difference = (above[row] - below[row]) / (2 * size[column]);
        EXPECT_NEAR(dual[row].derivatives()[static_cast<int>(column)] * size[column] / scale[row],
                    difference * size[column] / scale[row], 1e-6)
            << row << " by " << column;
      }
    }
  }
}

TEST(ServoActuator, DerivativesAreWhatDifferencesSay) {
  expect_derivatives_of(ServoActuator());
  expect_derivatives_of(PrestabilisedServo({}, {2000.0, 40.0}));
}

TEST(ServoActuator, ConsumptionIsTheSupplyValvesFlow) {
  const ServoActuator model;
  Vector<double, 8> x = {0.05, 0.0, 1.5e5, 1.6e5, 0.3, 0.0, -0.4, 0.0};
  EXPECT_DOUBLE_EQ(model.consumption<double>(x, {}), 0.3 * model.fill_flow<double>(1.5e5));
  x[opening_b] = 0.2;
  EXPECT_DOUBLE_EQ(model.consumption<double>(x, {}),
                   0.3 * model.fill_flow<double>(1.5e5) + 0.2 * model.fill_flow<double>(1.6e5));
}

}  // namespace
}  // namespace solenoid
