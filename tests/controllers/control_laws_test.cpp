#include "controllers/catalogue.hpp"
#include "controllers/mpc_controller.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "controllers/systems/actuator/motor_inputs.hpp"
#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

TEST(IntegralOffset, IsTheRunningSumOfTheThesisWithForgettingOne) {
  IntegralOffset offset({.gain = 0.005});
  double sum = 0;
  for (int i = 0; i < 500; ++i) {
    const double error = 1e-3 * std::sin(0.1 * i) + 2e-4;
    sum += error;
    EXPECT_DOUBLE_EQ(offset.update(error), 0.005 * sum);
  }
}

TEST(IntegralOffset, ForgetsGeometricallyAndStaysInItsBound) {
  IntegralOffset fading({.gain = 1.0, .forgetting = 0.9});
  fading.update(1.0);
  for (int i = 1; i < 50; ++i) EXPECT_NEAR(fading.update(0.0), std::pow(0.9, i), 1e-14);
  IntegralOffset bounded({.gain = 0.005, .limit_m = 0.002});
  for (int i = 0; i < 1000; ++i) EXPECT_LE(bounded.update(0.01), 0.002 * (1 + 1e-12));
  EXPECT_LT(bounded.update(-0.01), 0.002);  // no wind-up: it turns back at once
}

TEST(MotorLaws, InverseDynamicsMakeTheErrorDecayLinearly) {
  // m_eq e'' + K_d e' + K_p e = 0 while nothing saturates, (5.13).
  const PneumaticActuator model;
  const InverseDynamicsMotor law(model, {50.0, 5.0});
  const MotionSample desired{0.05, 0.1, 0.02};
  const ActuatorState x{0.0499, 0.098, 101325 * 1.25, 101325};
  const double force = law.force(desired, x), m = model.parameters().equivalent_mass_kg();
  ASSERT_LT(std::abs(force), 7.99);
  const double applied = model.cylinder_force(x[2], x[3]) + model.gravity_force(x[0]) + force;
  const double acceleration = (model.velocity_after(x[1], applied, 1e-6) - x[1]) / 1e-6;
  EXPECT_NEAR(m * (0.02 - acceleration) + 5.0 * 0.002 + 50.0 * 0.0001, 0.0, 1e-6);
  EXPECT_NEAR(PdMotor(model, {}).force(desired, x), 23000 * 0.0001 + 400 * 0.002, 1e-9);
  EXPECT_NEAR(PdMotor(model, {}).force(MotionSample{0.06, 0, 0}, x), 8.0, 1e-12);
}

TEST(MotorLaws, InverseDynamicsCarryALoadThatWasEstimated) {
  const PneumaticActuator nominal;
  ActuatorParameters heavier;
  heavier.payload_mass_kg = 0.02;
  InverseDynamicsMotor told(nominal, {50.0, 5.0});
  const InverseDynamicsMotor knows(PneumaticActuator(heavier), {50.0, 5.0});
  const MotionSample desired{0.05, 0.1, 0.02};
  const ActuatorState x{0.0499, 0.098, 101325 * 1.25, 101325};
  const double before = told.force(desired, x);
  told.set_load(0.02, 0.0);
  EXPECT_NEAR(told.force(desired, x), knows.force(desired, x), 1e-9);
  EXPECT_GT(told.force(desired, x), before + 0.1);
  told.set_load(0.02, 0.7);  // a force towards +y does some of the work
  EXPECT_NEAR(told.force(desired, x), knows.force(desired, x) - 0.7, 1e-9);
}

/// Plans mode 1, 2, 3, 1, ... and calls every third plan unusable.
struct Scripted final : Solver<PneumaticActuator> {
  explicit Scripted(std::vector<double>& references) : references(references) {}
  void prepare(const Problem<PneumaticActuator>&) override {}
  SolveReport solve(const Problem<PneumaticActuator>& p, Plan<PneumaticActuator>& plan, Deadline) noexcept override {
    references.push_back(p.reference.front()[0]);
    plan.modes.front() = 1 + calls % 3;
    SolveReport report;
    report.status = ++calls % 3 == 0 ? Status::numerical_failure : Status::optimal;
    return report;
  }
  std::vector<double>& references;
  int calls = 0;
};

template <HybridModel Model>
using ActuatorMpc = MpcController<Model, MotorInputs>;

/// The shell around a predictive decider, as the factory makes it.
template <HybridModel Model>
ControllerShell<ActuatorMpc<Model>> predictive(typename ActuatorMpc<Model>::Parts parts, const Trajectory& motion,
                                               const MotorLaw& motor = NoMotor{}) {
  const ModeSet modes = parts.problem.modes;
  parts.outputs = actuator_description().outputs;
  parts.inputs = MotorInputs(motor);
  return {
      {RestartableReference(motion), make_estimator("thesis", PneumaticActuator{}, {}), modes, actuator_timing.tick_s},
      ActuatorMpc<Model>(std::move(parts))};
}

TEST(MpcController, CommandsEveryPeriodKeepsThroughFailuresAndShiftsTheReference) {
  std::vector<double> references;
  Problem<PneumaticActuator> problem(PneumaticActuator{}, valve_modes("three_way", {}), {1e-3, {100}}, {});
  auto controller = predictive<PneumaticActuator>(
      {std::move(problem), std::make_unique<Scripted>(references), {.gain = 0.005}, std::nullopt, 0}, Trajectory(0.06));
  const SwitchPattern expected[] = {1, 2, 2, 1, 2, 2};  // the third and sixth plans are not to be applied
  Measurement sensors;
  sensors.ideal = true;
  sensors.truth = {0.05, 0, 101325, 101325};
  for (int k = 0; k < 30; ++k) {
    sensors.time_s = 1e-3 * k;
    const Decision d = controller.step(sensors);
    EXPECT_EQ(d.solved, k % 5 == 0);
    EXPECT_EQ(d.command.switches, expected[k / 5]) << k;
    EXPECT_NEAR(d.offset[0], 0.005 * 0.01 * (k + 1), 1e-15);
  }
  ASSERT_EQ(references.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(references[i], 0.06 + 0.005 * 0.01 * static_cast<double>(5 * i + 1), 1e-15);
}

/// Keeps the problems it is posed and expected to be posed; its plans pulse.
template <HybridModel Model>
struct Listening final : Solver<Model> {
  explicit Listening(std::vector<Problem<Model>>& posed, std::vector<Problem<Model>>& expected)
      : posed(posed), expected(expected) {}
  void prepare(const Problem<Model>&) override {}
  SolveReport solve(const Problem<Model>& p, Plan<Model>& plan, Deadline) noexcept override {
    posed.push_back(p);
    for (std::size_t b = 0; b < plan.modes.size(); ++b) plan.modes[b] = b % 3 == 1;
    SolveReport report;
    report.status = Status::feasible;
    return report;
  }
  bool anticipates() const override { return true; }
  void anticipate(const Problem<Model>& p, const Plan<Model>&) noexcept override { expected.push_back(p); }
  std::vector<Problem<Model>>&posed, &expected;
};

TEST(MpcController, WhatTheLawTracksAndWhatTheCostTracksAreOneReferenceAStepApart) {
  const Trajectory motion = thesis_sine(0.02);
  for (const int lead : {0, 5}) {
    std::vector<Problem<PrestabilisedActuator>> posed, expected;
    Problem<PrestabilisedActuator> problem(PrestabilisedActuator(), valve_modes("two_way", {}),
                                           {actuator_timing.tick_s, {10}}, {});
    auto controller = predictive<PrestabilisedActuator>(
        {std::move(problem), std::make_unique<Listening<PrestabilisedActuator>>(posed, expected), {}, {}, lead},
        motion);
    Measurement sensors;
    sensors.ideal = true;
    sensors.truth = {0.05, 0, 101325, 101325};
    controller.step(sensors);
    ASSERT_EQ(posed.size(), 1u);
    for (std::size_t j = 0; j < 10; ++j) {
      const double begin_s = (lead + static_cast<double>(j)) * actuator_timing.tick_s;
      EXPECT_NEAR(posed[0].setpoint[j][0], motion.at(begin_s).value, 1e-15);
      EXPECT_NEAR(posed[0].setpoint[j][1], motion.at(begin_s).rate, 1e-15);
      EXPECT_NEAR(posed[0].reference[j][0], motion.at(begin_s + actuator_timing.tick_s).value, 1e-15);
      EXPECT_NEAR(posed[0].reference[j][1], motion.at(begin_s + actuator_timing.tick_s).rate, 1e-15);
    }
  }
}

/// Plans of a mode a tick are followed tick by tick, and on a plant that does what the model says the problem expected
/// in the last tick of a slot is the problem posed in the next, whatever the latency.
TEST(MpcController, ExpectsWhatItIsThenPosed) {
  for (const int latency : {0, 5}) {
    std::vector<Problem<PneumaticActuator>> posed, expected;
    const PneumaticActuator model;
    const ModeSet modes = valve_modes("three_way", {});
    Problem<PneumaticActuator> problem(model, modes, {actuator_timing.tick_s, std::vector<int>(20, 1)}, {});
    auto controller = predictive<PneumaticActuator>(
        {std::move(problem), std::make_unique<Listening<PneumaticActuator>>(posed, expected), {}, {}, latency},
        thesis_sine(0.02), PdMotor(model, {}));
    const SwitchTiming timing(modes, actuator_timing.tick_s);
    DelayLines lines(0);
    Measurement sensors;
    sensors.ideal = true;
    sensors.truth = {0.0202, 0.0, 1.2e5, 1.2e5};
    for (int k = 0; k < 40; ++k) {
      sensors.time_s = k * actuator_timing.tick_s;
      const Decision d = controller.step(sensors);
      const int begun = k - latency;
      if (begun >= 0) {
        EXPECT_EQ(d.command.switches, modes.pattern(begun % 5 % 3 == 1)) << k;
      }
      lines.command(d.command.switches, timing);
      Vector<double, 4> opening;
      std::ranges::copy(modes.point(lines.effective()), opening.begin());
      sensors.truth = padded<max_states>(model.step<double>(actuator_state(sensors.truth), opening,
                                                            {d.command.continuous[0]}, actuator_timing.tick_s));
      lines.advance(1);
    }
    ASSERT_EQ(posed.size(), 8u);
    ASSERT_EQ(expected.size(), 8u);
    for (std::size_t i = 1; i < posed.size(); ++i) {
      EXPECT_EQ(expected[i - 1].lines, posed[i].lines) << latency;
      for (std::size_t n = 0; n < 4; ++n)
        EXPECT_NEAR(expected[i - 1].initial[n], posed[i].initial[n], 1e-9 * std::abs(posed[i].initial[n]) + 1e-15);
      for (std::size_t j = 0; j < 20; ++j)
        EXPECT_NEAR(expected[i - 1].reference[j][0], posed[i].reference[j][0], 1e-12);
    }
  }
}

}  // namespace
}  // namespace solenoid
