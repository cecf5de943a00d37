// A variant with an identified force: what it cannot be, the estimator that shares the force with the prediction, and
// derivatives through it.
#include "controllers/estimators/sensitivity.hpp"
#include "controllers/systems.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "controllers/systems/actuator/estimators/kalman.hpp"
#include "core/systems/actuator/signals.hpp"
#include "tests/support/variant_text.hpp"

#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string some_residual =
    "residual = { velocity = { knots_m_s = [-0.4, -0.3, -0.01, 0.0, 0.01, 0.3, 0.4], force_n = [0, 3, 2, 0, -2, -3, 0] "
    "} }\n";
const std::string usual_keys = "estimator = \"payload_ekf\"\nuse_estimate = \"payload_and_disturbance\"\n";

std::string residual_refusal(const std::string& keys) { return test::refusal_of(some_residual + keys); }

TEST(ResidualVariants, ReadTheForceIntoTheirModel) {
  const VariantConfig v = test::variant_of(some_residual + usual_keys + "motor = \"in_prediction\"\n");
  EXPECT_TRUE(has_residual(v));
  const auto problem = system_of(v).problem(v);
  const auto* own = dynamic_cast<const Problem<ResidualActuator>*>(problem.get());
  ASSERT_NE(own, nullptr);
  EXPECT_NEAR(own->model.residual().force(0.05, 0.3), -3.0, 1e-12);
  EXPECT_EQ(own->model.gains(), actuator(v).motor_gains);
  const VariantConfig alone = test::variant_of(some_residual + usual_keys);
  const auto bare = system_of(alone).problem(alone);
  EXPECT_EQ(dynamic_cast<const Problem<ResidualActuator>*>(bare.get())->model.gains(), (MotorGains{0.0, 0.0}));
  const VariantConfig without = test::variant_of(usual_keys + "motor = \"in_prediction\"\n");
  const auto usual = system_of(without).problem(without);
  EXPECT_NE(dynamic_cast<const Problem<PrestabilisedActuator>*>(usual.get()), nullptr);
}

TEST(ResidualVariants, WhatDoesNotPredictWithOneIsRefused) {
  for (const char* solver : {"sqp", "ipopt", "three_mode_sliding"})
    EXPECT_THAT(residual_refusal("valves = \"three_mode\"\nsolver = \"" + std::string(solver) + "\""),
                AllOf(HasSubstr("residual"), HasSubstr(solver), HasSubstr("allowed: with branch_and_bound")));
  EXPECT_THAT(residual_refusal("valves = \"servo\"\nsolver = \"sqp\""), HasSubstr("residual"));
  EXPECT_THAT(residual_refusal("motor = \"inverse_dynamics\""),
              AllOf(HasSubstr("residual"), HasSubstr("in_prediction")));
  // Whether there is a maker for the model is asked without making one: a network is not taken in yet.
  EXPECT_THAT(residual_refusal("solver = \"policy\""), HasSubstr("key 'learned': 'policy' has no network"));
  EXPECT_THAT(test::refusal_of("residual = {}"), HasSubstr("explains anything"));
  EXPECT_THAT(test::refusal_of("residual = \"not_there.toml\""), HasSubstr("not_there.toml"));
  EXPECT_THAT(test::refusal_of("residual = \"found.txt\""),
              AllOf(HasSubstr("found.txt"), HasSubstr("allowed: a file in .toml")));
}

/// A slide with twice the Coulomb friction that is believed, driven to and fro by the motor, through both estimators.
struct Driven {
  double disturbance_without = 0.0, disturbance_with = 0.0;  ///< root mean squares [N]
};
Driven driven(double friction_sigma) {
  const VariantConfig v = test::variant_of(some_residual + usual_keys);
  EstimatorTuning without;
  without.pressure_filter_hz = 0.0;
  without.friction_sigma = friction_sigma;
  EstimatorTuning with = without;
  with.residual = actuator(v).residual;
  const PneumaticActuator believed;
  const ResidualActuator plant({}, {0.0, 0.0}, actuator(v).residual);
  ActuatorKalman first(believed, without), second(believed, with);
  ActuatorState x = {believed.parameters().equilibrium_position_m(), 0.0, 101325.0, 101325.0};
  std::mt19937_64 random(4);
  std::normal_distribution<double> noise(0.0, 3e-5);
  Driven sums;
  constexpr int ticks = 4000, settled = 1500;
  for (int k = 0; k < ticks; ++k) {
    const Measurement m{0.001 * k, {x[position] + noise(random), x[pressure_a], x[pressure_b]}};
    first.update(m);
    second.update(m);
    if (k >= settled) {
      sums.disturbance_without += std::pow(first.detail().belief[disturbance_belief], 2) / (ticks - settled);
      sums.disturbance_with += std::pow(second.detail().belief[disturbance_belief], 2) / (ticks - settled);
    }
    const double motor_n = 7.0 * std::sin(2 * std::numbers::pi * 1.5 * 0.001 * k);
    first.applied({0, 1, 0, 1}, motor_n);
    second.applied({0, 1, 0, 1}, motor_n);
    x = plant.step<double>(x, {0, 1, 0, 1}, {motor_n}, 0.001);
  }
  return {std::sqrt(sums.disturbance_without), std::sqrt(sums.disturbance_with)};
}

TEST(ResidualEstimator, LeavesTheDisturbanceWithWhatTheForceLeaves) {
  const Driven found = driven(0.0);
  EXPECT_LT(found.disturbance_with, 0.35 * found.disturbance_without);
  EXPECT_GT(found.disturbance_without, 0.3);
}

TEST(ResidualEstimator, DerivativesAreThoseOfTheForce) {
  const VariantConfig v = test::variant_of(some_residual + usual_keys);
  const LoadedActuator model(PneumaticActuator(), {}, actuator(v).residual);
  std::mt19937_64 random(8);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (int trial = 0; trial < 100; ++trial) {
    const StateOf<LoadedActuator> x = {uniform(0.01, 0.1),    (trial % 2 ? 1 : -1) * uniform(0.02, 0.28),
                                       uniform(1.1e5, 1.3e5), uniform(1.1e5, 1.3e5),
                                       uniform(-1, 1),        uniform(0, 0.3),
                                       uniform(0.8, 1.2),     uniform(0.7, 2)};
    const SwitchedOf<LoadedActuator> opening = {0, 1, 1, 0};
    Eigen::Matrix<double, 8, 8> exact;
    linearise(model, x, opening, {1.0}, 1e-3, exact);
    auto up = x, down = x;
    const double h = 1e-6;
    up[velocity] += h, down[velocity] -= h;
    const double slope = (model.step<double>(up, opening, {1.0}, 1e-3)[velocity] -
                          model.step<double>(down, opening, {1.0}, 1e-3)[velocity]) /
                         (2 * h);
    EXPECT_NEAR(exact(velocity, velocity), slope, 1e-7);
  }
}

}  // namespace
}  // namespace solenoid
