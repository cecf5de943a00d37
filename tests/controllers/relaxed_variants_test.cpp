// Relaxed variants through the factory: they track on their own model, whatever the motor does.
#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/systems/actuator/valves.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

TEST(RelaxedVariants, TrackTheSineOnTheirOwnModel) {
  for (const char* motor : {"none", "in_prediction", "joint"}) {
    VariantConfig v = new_variant();
    v.solver = "sqp";
    actuator(v).motor = motor;
    const double start_m = actuator(v).nominal.equilibrium_position_m();
    const Trajectory motion = thesis_sine(start_m);
    const auto controller = make_controller(v, motion);
    const PneumaticActuator plant(actuator(v).nominal);
    const ModeSet modes = valve_modes(v.modes, actuator(v).nominal);
    const SwitchTiming timing(modes, 0.001);
    DelayLines lines(0);
    ActuatorState x = {start_m, 0.0, 101325.0, 101325.0};
    double sum = 0.0;
    int solves = 0, failures = 0;
    for (int k = 0; k < 2500; ++k) {
      const Decision d =
          controller->step({0.001 * k, {x[position], x[pressure_a], x[pressure_b]}, padded<max_states>(x), true});
      solves += d.solved, failures += d.solved && !usable(d.report.status);
      EXPECT_GE(modes.find(d.command.switches), 0);
      EXPECT_LE(std::abs(d.command.continuous[0]), 8.0 + 1e-6);
      sum += std::pow(x[position] - d.reference.axis[0].value, 2);
      lines.command(d.command.switches, timing);
      Vector<double, 4> opening{};
      std::ranges::copy(modes.point(lines.effective()), opening.begin());
      x = plant.step<double>(x, opening, {d.command.continuous[0]}, 0.001);
      lines.advance(1);
    }
    const double rmse_mm = 1e3 * std::sqrt(sum / 2500);
    std::printf("  %s: %.3f mm, %d of %d solves unusable\n", motor, rmse_mm, failures, solves);
    EXPECT_LT(rmse_mm, 0.05) << motor;
    EXPECT_EQ(failures, 0) << motor;
  }
}

}  // namespace
}  // namespace solenoid
