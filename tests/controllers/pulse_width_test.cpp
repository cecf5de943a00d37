// Pulses of whole ticks through delayed switches: on-times follow what is wanted, delays made up for.
#include "controllers/pulse_width.hpp"

#include "controllers/factory.hpp"
#include "controllers/relaxed_controller.hpp"
#include "core/actuator/valves.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// Mean state in effect of switch 0 over `periods` with a constant wish.
double mean_on(const ModeSet& modes, const SwitchStates<double>& wish, int periods, int& edges) {
  PulseWidth pulses(modes, 0.001);
  const SwitchTiming timing(modes, 0.001);
  SwitchLines lines(0);
  PulseWidth::Wanted wanted;
  wanted.fill(wish);
  double on = 0.0;
  edges = 0;
  for (int k = 0; k < periods; ++k) {
    pulses.plan(wanted, lines);
    for (int i = 0; i < PulseWidth::ticks; ++i) {
      const SwitchPattern pattern = pulses.command(i);
      EXPECT_GE(modes.find(pattern), 0);
      edges += std::popcount(pattern ^ lines.commanded());
      lines.command(pattern, timing);
      pulses.applied(i, lines.effective());
      on += lines.effective() & 1u;
      lines.advance(1);
    }
  }
  return on / (periods * PulseWidth::ticks);
}

TEST(PulseWidth, MeanOnTimeIsTheDutyDespiteDelays) {
  const ActuatorParameters p;  // 4 ms to energise, 1 ms to release
  for (const char* valves : {"three_way", "two_way"})
    for (const double duty : {0.0, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.93, 1.0}) {
      SwitchStates<double> wish{};
      wish[0] = duty;
      int edges = 0;
      EXPECT_NEAR(mean_on(valve_modes(valves, p), wish, 400, edges), duty, 0.01) << valves;
      if (duty == 0.0 || duty == 1.0) {
        EXPECT_LE(edges, 1);
      }
    }
}

TEST(PulseWidth, WithoutDelaysEveryPeriodKeepsItsDutyToATick) {
  ActuatorParameters p;
  p.energise_delay_s = p.deenergise_delay_s = 0.0;
  for (const double duty : {0.2, 0.4, 0.6, 0.8}) {
    SwitchStates<double> wish{};
    wish[0] = duty;
    int edges = 0;
    EXPECT_NEAR(mean_on(valve_modes("three_way", p), wish, 50, edges), duty, 0.01);
    EXPECT_LE(edges, 2 * 50 + 1);  // a pulse a period, and the first edge
  }
}

TEST(PulseWidth, ValvesThatExcludeEachOtherAreNeverOpenTogether) {
  SwitchStates<double> wish{};
  wish[0] = wish[1] = 0.5;
  int edges = 0;
  mean_on(valve_modes("two_way", ActuatorParameters()), wish, 200, edges);  // find() >= 0 inside
  EXPECT_GT(edges, 10);
}

TEST(RelaxedVariants, TrackTheSineOnTheirOwnModel) {
  for (const char* motor : {"none", "in_prediction", "joint"}) {
    VariantConfig v;
    v.solver = "sqp";
    v.motor = motor;
    const double start_m = v.believed.equilibrium_position_m();
    const Trajectory motion = thesis_sine(start_m);
    const auto controller = make_controller(v, motion, Plane::vertical);
    const PneumaticActuator plant(v.believed);
    const ModeSet modes = valve_modes(v.valves, v.believed);
    const SwitchTiming timing(modes, 0.001);
    SwitchLines lines(0);
    ActuatorState x = {start_m, 0.0, 101325.0, 101325.0};
    double sum = 0.0;
    int solves = 0, failures = 0;
    for (int k = 0; k < 2500; ++k) {
      const Decision d = controller->step({0.001 * k, x[position], x[pressure_a], x[pressure_b], x, true});
      solves += d.solved, failures += d.solved && !usable(d.report.status);
      EXPECT_GE(modes.find(d.command.coils), 0);
      EXPECT_LE(std::abs(d.command.motor_force_n), 8.0 + 1e-6);
      sum += std::pow(x[position] - d.reference.position, 2);
      lines.command(d.command.coils, timing);
      Vector<double, 4> opening{};
      std::ranges::copy(modes.point(lines.effective()), opening.begin());
      x = plant.step<double>(x, opening, {d.command.motor_force_n}, 0.001);
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
