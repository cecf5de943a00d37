// The truth plant on servo valves.
#include "core/systems/actuator/servo_actuator.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/systems/actuator/simulation/model_plant.hpp"
#include "tests/experiments/systems/actuator/twin/twin_support.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

Command servo_command(double a, double b) { return {0, {0.0, a, b}}; }

TEST(TwinServo, OpeningsInContinuousTimeAreThoseOfTicks) {
  const ServoValve valve;
  ServoActuation continuous(valve);
  ServoPair ticks(valve, 1e-3);
  for (int k = 0; k < 40; ++k) {
    const double a = 0.8 * std::sin(0.4 * k), b = 0.1 * std::cos(0.9 * k), t = 1e-3 * k;
    const Openings begin = (continuous.command(a, b, t), continuous.openings(t)), end = continuous.openings(t + 1e-3);
    const auto mean = ticks.openings(a, b);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(mean[i], 0.5 * (begin[i] + end[i]), 1e-12);
    ticks.advance();
    const auto is = continuous.state(t + 1e-3), was = ticks.state();
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(is[i], was[i], 1e-9);
  }
}

TEST(TwinServo, FixedStepsConvergeToTheAdaptiveOnes) {
  TwinParameters parameters = full_twin();
  parameters.friction.law = FrictionLaw::model;
  const ModeSet modes = valve_modes(servo_valves, parameters.actuator);
  const auto pressure_after = [&](Integration method, int steps) {
    TwinParameters own = parameters;
    own.integration = {method, steps, 1e-10};
    const TwinPhysics with(own);
    TwinIntegrator integrator(with, modes);
    ServoActuation valves(own.actuator.servo);
    TwinState x = with.state_at_rest(0.05);
    valves.command(0.5, 0.45, 0.0);
    for (int i = 0; i < 100; ++i) integrator.advance(x, valves, 0.0, 1e-4 * i, 1e-4 * (i + 1));
    return std::array{x[pressure_a], x[pressure_b]};
  };
  const auto exact = pressure_after(Integration::adaptive, 1);
  double before = 0.0;
  for (const int steps : {1, 4}) {
    const auto fixed = pressure_after(Integration::fixed, steps);
    const double off = std::max(std::abs(fixed[0] - exact[0]), std::abs(fixed[1] - exact[1]));
    EXPECT_LT(off, 60.0) << steps;
    if (steps > 1) {
      EXPECT_LT(off, 0.5 * before);
    }
    before = off;
  }
  EXPECT_GT(exact[0], 1.05e5);
}

TEST(TwinServo, PlantsFillAndEmptyAndCountTheirAir) {
  TwinPlant twin(twin_from(""), servo_valves, 0.05, {.ideal = true, .noise = false});
  ModelPlant model({}, servo_valves, 0.05, {});
  for (SimulatedPlant* plant : {static_cast<SimulatedPlant*>(&twin), static_cast<SimulatedPlant*>(&model)}) {
    Measurement m = plant->read(0.0);
    EXPECT_EQ(m.truth[opening_a], 0.0);
    plant->write(servo_command(0.6, 0.6));
    m = plant->read(0.1);
    const double full = m.truth[pressure_a], drawn = plant->consumed();
    EXPECT_GT(full, 1.8e5);
    EXPECT_GT(drawn, 0.0);
    EXPECT_NEAR(m.truth[opening_a], (0.6 - 0.05) / 0.95, 0.01);
    plant->write(servo_command(-0.6, -0.6));
    m = plant->read(0.3);
    EXPECT_LT(m.truth[pressure_a], full - 5e4);
    EXPECT_LT(plant->consumed() - drawn, 0.2 * drawn);  // what flows on until the spool is across
    EXPECT_LT(m.truth[opening_a], -0.5);
  }
}

TEST(TwinServo, AtNullAClosedChamberLeaks) {
  const auto drawn_in_a_second = [](double leakage) {
    ActuatorParameters p;
    p.servo.leakage = leakage;
    ModelPlant plant(p, servo_valves, 0.05, {});
    plant.read(1.0);
    return plant.consumed();
  };
  EXPECT_EQ(drawn_in_a_second(0.0), 0.0);
  EXPECT_GT(drawn_in_a_second(0.02), 1.5 * drawn_in_a_second(0.01));
}

}  // namespace
}  // namespace solenoid
