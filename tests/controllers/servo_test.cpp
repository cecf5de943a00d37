// Variants on servo valves through the factory: they track on their own model, and what cannot be is refused in words.
#include "controllers/factory.hpp"
#include "controllers/systems.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/systems/actuator/signals.hpp"
#include "tests/support/variant_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string on_servo = "valves = \"servo\"\n";

VariantConfig read_servo(const std::string& keys) { return test::variant_of(on_servo + keys); }
std::string servo_refusal(const std::string& keys) { return test::refusal_of(on_servo + keys); }

TEST(ServoVariants, WhatPlansNoOpeningsIsRefused) {
  for (const char* solver : {"exhaustive", "branch_and_bound", "sum_up_rounding", "cia", "relaxed_pulses", "ipopt",
                             "extended_cost", "pulse_width_pid", "three_mode_sliding"})
    EXPECT_THAT(servo_refusal("solver = \"" + std::string(solver) + "\""),
                AllOf(HasSubstr("solver"), HasSubstr(solver), HasSubstr("servo"), HasSubstr("allowed solvers: sqp")));
  EXPECT_THAT(servo_refusal("solver = \"sqp\"\nservo = { deadband = 0.1 }"), HasSubstr("deadband"));
  EXPECT_THAT(servo_refusal("solver = \"sqp\"\nservo = { compensation = 2.0 }"), HasSubstr("compensation"));
  EXPECT_THAT(servo_refusal("solver = \"sqp\"\nmodel = { servo = { damping = 3.0 } }"), HasSubstr("damping"));
  EXPECT_EQ(actuator(read_servo("solver = \"sqp\"\nservo = { effort = 1e-6 }")).servo.effort, 1e-6);
}

TEST(ServoVariants, HaveTheirCommandsInTheirDescriptionAlone) {
  const VariantConfig servo = read_servo("solver = \"sqp\"");
  const System& system = system_of(servo);
  EXPECT_EQ(input_names(system.description_for(servo)), "motor valve_a valve_b");
  EXPECT_EQ(input_names(system.description_for(new_variant())), "motor");
  EXPECT_NO_THROW(require_complete(system.description_for(servo)));
  EXPECT_EQ(&system.description_for(servo), system.descriptions().back());
  EXPECT_EQ(system.continuous_limits(servo).size(), 3u);
  EXPECT_EQ(system.continuous_limits(new_variant()).size(), 1u);
  CommandLimits limits = make_limits(servo);
  const Command left = limits.checked({0, {99.0, -3.0, std::nan("")}});
  EXPECT_EQ(left.continuous, (ContinuousValues{8.0, -1.0, 0.0}));
  EXPECT_EQ(limits.safe_command(), Command{});
}

TEST(ServoInputs, CommandMakesUpForTheOverlap) {
  const ServoInputs inputs(MotorInputs(), {.compensation = 0.05, .transition = 0.01}, false);
  EXPECT_EQ(inputs.command_for(0.0), 0.0);
  EXPECT_NEAR(inputs.command_for(1.0), 1.0, 1e-5);
  EXPECT_NEAR(inputs.command_for(-3.0), -1.0, 1e-5);
  EXPECT_EQ(inputs.command_for(-0.3), -inputs.command_for(0.3));
  const ServoValve valve{.leakage = 0.0};
  for (const double wanted : {0.05, 0.2, 0.7})  // beyond the transition it is the inverse of the valve
    EXPECT_NEAR(valve.opening(inputs.command_for(wanted)), wanted, 1.2e-3);
  double before = inputs.command_for(-1.0);
  for (double o = -1.0; o <= 1.0; o += 1e-3) {
    EXPECT_GE(inputs.command_for(o), before);
    before = inputs.command_for(o);
  }
}

TEST(ServoVariants, TrackTheSineOnTheirOwnModel) {
  for (const char* motor : {"none", "in_prediction", "joint"}) {
    VariantConfig v =
        read_servo("solver = \"sqp\"\nmotor = \"" + std::string(motor) + "\"\nservo = { compensation = 0 }");
    const double start_m = actuator(v).nominal.equilibrium_position_m();
    const Trajectory motion = thesis_sine(start_m);
    const auto controller = make_controller(v, motion);
    const ServoActuator plant(actuator(v).nominal);
    StateOf<ServoActuator> x = {start_m, 0.0, 101325.0, 101325.0};
    double sum = 0.0;
    int solves = 0, failures = 0;
    for (int k = 0; k < 2500; ++k) {
      const Decision d =
          controller->step({0.001 * k, {x[position], x[pressure_a], x[pressure_b]}, padded<max_states>(x), true});
      solves += d.solved, failures += d.solved && !usable(d.report.status);
      EXPECT_EQ(d.command.switches, 0u);
      if (actuator(v).motor == "none") {
        EXPECT_EQ(d.command.continuous[motor_input], 0.0);
      }
      EXPECT_LE(std::abs(d.command.continuous[opening_a_input]), 1.0 + 1e-9);
      sum += std::pow(x[position] - d.reference.axis[0].value, 2);
      x = plant.step<double>(x, {}, first<3>(d.command.continuous), 0.001);
    }
    const double rmse_mm = 1e3 * std::sqrt(sum / 2500);
    std::printf("  %s: %.4f mm, %d of %d solves unusable\n", motor, rmse_mm, failures, solves);
    EXPECT_LT(rmse_mm, 0.05) << motor;
    EXPECT_EQ(failures, 0) << motor;
    EXPECT_EQ(solves, 500) << motor;
  }
}

}  // namespace
}  // namespace solenoid
