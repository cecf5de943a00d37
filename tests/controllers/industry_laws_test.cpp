// What plants do, and the seven-mode sliding law: closed forms of the choice, and where a motion ends.
#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "controllers/systems/actuator/laws/end_position.hpp"
#include "controllers/systems/actuator/laws/servo_pid.hpp"
#include "controllers/systems/actuator/laws/seven_mode_sliding.hpp"
#include "core/systems/actuator/servo_actuator.hpp"
#include "core/systems/actuator/valves.hpp"
#include "tests/support/law_scene.hpp"
#include "tests/support/variant_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

using test::LawScene;

std::vector<double> openings(const ModeSet& modes, SwitchPattern pattern) {
  const auto point = modes.point(pattern);
  return {point.begin(), point.end()};
}

TEST(SevenModeSliding, BandsOfTheSurfaceAndTheMeanPressureChooseTheMode) {
  for (const char* valves : {"seven_mode", "two_way"}) {
    const ModeSet modes = valve_modes(valves, ActuatorParameters());
    const SevenModeSliding law({.dead_band_m = 1e-4}, {.full_above_m = 5e-4, .mean_pressure_pa = 2e5}, modes);
    const auto chosen = [&](double s, double mean_pa) { return openings(modes, law.mode(s, mean_pa)); };
    for (const double low : {1.1e5, 1.99e5}) {
      EXPECT_THAT(chosen(3e-4, low), ElementsAre(1, 0, 0, 0));   // A fills
      EXPECT_THAT(chosen(-3e-4, low), ElementsAre(0, 0, 1, 0));  // B fills
    }
    for (const double high : {2e5, 5e5}) {
      EXPECT_THAT(chosen(3e-4, high), ElementsAre(0, 0, 0, 1));   // B exhausts
      EXPECT_THAT(chosen(-3e-4, high), ElementsAre(0, 1, 0, 0));  // A exhausts
    }
    const ThreeModeSliding three({.dead_band_m = 1e-4}, modes);
    for (const double s : {0.0, 0.9e-4, -1e-4, 5.1e-4, -5.1e-4, 1e-2})
      for (const double mean : {1.1e5, 3e5}) EXPECT_EQ(law.mode(s, mean), three.mode(s)) << s;  // elsewhere the same
  }
}

TEST(SevenModeSliding, FollowsTheSurfaceOfTheThreeModeLawEveryNthTick) {
  LawScene bench;
  const ModeSet modes = valve_modes("seven_mode", ActuatorParameters());
  const SlidingSettings settings{.dead_band_m = 1e-4, .every_ticks = 5};
  SevenModeSliding law(settings, {.full_above_m = 5e-4}, modes);
  bench.state[position] = 0.05 - 3e-4;  // at rest and without force the surface is the error
  EXPECT_NEAR(ThreeModeSliding(settings, modes).surface(bench.at(0)), 3e-4, 1e-12);
  EXPECT_THAT(openings(modes, law.coils(bench.at(0))), ElementsAre(1, 0, 0, 0));
  bench.state[position] = 0.06;
  for (int k = 1; k < 5; ++k) EXPECT_THAT(openings(modes, law.coils(bench.at(k))), ElementsAre(1, 0, 0, 0));
  EXPECT_THAT(openings(modes, law.coils(bench.at(5))), ElementsAre(0, 1, 1, 0));
}

TEST(EndPosition, FillsThrottlesCushionsAndStops) {
  LawScene bench;
  const ModeSet modes = valve_modes("two_way", ActuatorParameters());
  const EndPositionSettings settings{.start_m = 5e-4,
                                     .stop_m = 2e-4,
                                     .anticipation_s = 0.01,
                                     .cushion_m = 2e-3,
                                     .exhaust_share = 0.4,
                                     .period_ticks = 10};
  for (const double way : {1.0, -1.0}) {
    EndPosition law(settings, modes);
    const auto at = [&](std::int64_t tick, double left_m, double speed) {
      bench.state[position] = 0.05 - way * left_m;
      bench.state[velocity] = way * speed;
      std::vector<double> o = openings(modes, law.coils(bench.at(tick)));
      if (way < 0) std::swap(o[0], o[2]), std::swap(o[1], o[3]);
      return o;
    };
    EXPECT_THAT(at(0, 4.9e-4, 0.0), ElementsAre(0, 0, 0, 0));  // left alone
    EXPECT_EQ(law.way(), 0);
    for (int k = 0; k < 20; ++k)
      EXPECT_THAT(at(3 + k, 0.03, 0.1), ElementsAre(1, 0, 0, k % 10 < 4 ? 1 : 0)) << k;  // the throttle's mean: 0.4
    EXPECT_EQ(law.way(), static_cast<int>(way));
    EXPECT_THAT(at(23, 1.9e-3, 0.1), ElementsAre(1, 0, 0, 0));   // cushioned
    EXPECT_THAT(at(24, 1.19e-3, 0.1), ElementsAre(0, 0, 0, 0));  // 0.2 mm and 10 ms at 0.1 m/s
    EXPECT_THAT(at(25, -4.9e-4, 0.0), ElementsAre(0, 0, 0, 0));  // beyond, and near enough
    EXPECT_EQ(law.way(), 0);
    at(26, -6e-4, 0.0);
    EXPECT_EQ(law.way(), -static_cast<int>(way));  // back again
    law.restart();
    EXPECT_EQ(law.way(), 0);
  }
}

TEST(EndPosition, TargetLiesAheadOfTheDesiredPosition) {
  LawScene bench;
  bench.reference = RestartableReference(Trajectory(0.05).dwell(1.0).cycloid_to(0.08, 1.0));
  const ModeSet modes = valve_modes("two_way", ActuatorParameters());
  EndPosition now({.lead_s = 0.0}, modes), ahead({.lead_s = 2.0}, modes);
  now.coils(bench.at(0)), ahead.coils(bench.at(0));
  EXPECT_EQ(now.way(), 0);
  EXPECT_EQ(ahead.way(), 1);
}

TEST(ServoPid, OpeningIsTheSumOfItsTermsAndTheIntegralStaysBounded) {
  LawScene bench;
  bench.state[position] = 0.049, bench.state[velocity] = -0.02;
  const ServoPidSettings settings{.proportional = 20.0,
                                  .integral = 5.0,
                                  .integral_limit = 1e-4,
                                  .derivative = 3.0,
                                  .acceleration = 0.1,
                                  .feedforward = 2.0};
  ServoPid law(settings, {.compensation = 0.0}, 1e-3);
  EXPECT_NEAR(law.opening(bench.at(0)), 20.0 * 1e-3 + 3.0 * 0.02 + 5.0 * 1e-6, 1e-12);
  for (int k = 1; k < 100; ++k) law.opening(bench.at(k));
  EXPECT_NEAR(law.integral(), 1e-4, 1e-15);
  bench.motor_n = 5.0;  // a force that accelerates the slide is felt
  const double felt = 0.1 * 5.0 / bench.model.parameters().equivalent_mass_kg();
  EXPECT_NEAR(law.opening(bench.at(100)), 20.0 * 1e-3 + 3.0 * 0.02 + 1e-4 - felt, 1e-6);
  bench.motor_n = 0.0;
  bench.state[position] = -0.2;  // far beyond its bounds the integral waits
  law.restart();
  EXPECT_EQ(law.opening(bench.at(101)), 1.0);
  EXPECT_EQ(law.integral(), 0.0);
  const Command sent = law.command(bench.at(102));
  EXPECT_EQ(sent.switches, 0u);
  EXPECT_EQ(sent.continuous[opening_a_input], 1.0);
  EXPECT_EQ(sent.continuous[opening_b_input], -1.0);
}

/// The error [mm] after a cycloidal move of 60 mm in a second and a second of rest, on the model that is believed.
double settled_mm(const std::string& variant) {
  const VariantConfig v = test::variant_of(variant);
  const double start_m = 0.03, end_m = 0.09;
  const auto controller = make_controller(v, Trajectory(start_m).dwell(0.3).cycloid_to(end_m, 1.0).dwell(2.0));
  StateOf<ServoActuator> x = {start_m, 0.0, 150e3, 150e3};
  const auto measured = [&](int k) {
    return Measurement{1e-3 * k, {x[position], x[pressure_a], x[pressure_b]}, padded<max_states>(x), true};
  };
  if (on_servo_valves(v)) {
    const ServoActuator plant(actuator(v).nominal);
    for (int k = 0; k < 2300; ++k) {
      const Decision d = controller->step(measured(k));
      x = plant.step<double>(x, {}, first<3>(d.command.continuous), 1e-3);
    }
  } else {
    const PneumaticActuator plant(actuator(v).nominal);
    const ModeSet modes = valve_modes(v.modes, actuator(v).nominal);
    const SwitchTiming timing(modes, 1e-3);
    DelayLines lines(0);
    for (int k = 0; k < 2300; ++k) {
      const Decision d = controller->step(measured(k));
      lines.command(d.command.switches, timing);
      const auto own = plant.step<double>({x[0], x[1], x[2], x[3]}, modes.inputs<4>(lines.effective()),
                                          {d.command.continuous[0]}, 1e-3);
      std::ranges::copy(own, x.begin());
      lines.advance(1);
    }
  }
  return 1e3 * std::abs(x[position] - end_m);
}

TEST(IndustryLaws, EndAMotionWithinWhatTheirMakersClaim) {
  // Servo-pneumatic axes: +-0.2 mm. Cylinders stopped between their ends by valves: a millimetre or some.
  EXPECT_LT(settled_mm("valves = 'servo'\nsolver = 'servo_pid'\nservo = { compensation = 0.0 }"), 0.2);
  EXPECT_LT(
      settled_mm(
          "valves = 'two_way'\nsolver = 'end_position'\nend_position = { anticipation_s = 0.15 }\nmodel = { base = "
          "'inferred', inferred_equivalent_mass_kg = 11.0, arm_length_m = 0.32, viscous_friction = 20.0 }"),
      1.0);
  EXPECT_LT(settled_mm("valves = 'seven_mode'\nsolver = 'seven_mode_sliding'\nsliding = { frequency = 65.0, damping = "
                       "1.2, dead_band_m = 5e-5, every_ticks = 1 }"),
            0.2);
}

TEST(IndustryLaws, AreReadWithTheirTablesAndRefuseWhatTheyCannotUse) {
  const VariantConfig v = test::variant_of(
      "valves = 'seven_mode'\nsolver = 'seven_mode_sliding'\nsliding = { frequency = 40.0 }\n"
      "seven_mode = { full_above_m = 2e-3, mean_pressure_pa = 3e5 }");
  EXPECT_EQ(actuator(v).sliding.frequency, 40.0);
  EXPECT_EQ(actuator(v).seven_mode.full_above_m, 2e-3);
  EXPECT_EQ(actuator(v).seven_mode.mean_pressure_pa, 3e5);
  EXPECT_EQ(actuator(test::variant_of("valves = 'servo'\nsolver = 'servo_pid'\nservo = { compensation = 0.1 }"))
                .servo.compensation,
            0.1);
  const std::string seven = "valves = 'seven_mode'\nsolver = 'seven_mode_sliding'\n";
  EXPECT_THAT(test::refusal_of("valves = 'three_mode'\nsolver = 'seven_mode_sliding'"),
              AllOf(HasSubstr("'valves'"), HasSubstr("two_way, seven_mode")));
  EXPECT_THAT(test::refusal_of(seven + "sliding = { dead_band_m = 1e-3 }\nseven_mode = { full_above_m = 1e-4 }"),
              AllOf(HasSubstr("full_above_m"), HasSubstr("dead_band_m")));
  EXPECT_THAT(test::refusal_of(seven + "sliding = { dead_band_m = 1e-3 }"), HasSubstr("seven_mode"));
  EXPECT_THAT(test::refusal_of(seven + "motor = 'in_prediction'"), HasSubstr("motor"));
  EXPECT_THAT(test::refusal_of("valves = 'two_way'\nsolver = 'servo_pid'"), AllOf(HasSubstr("servo")));
  EXPECT_THAT(test::refusal_of("valves = 'servo'\nsolver = 'end_position'"),
              HasSubstr("allowed solvers: sqp, servo_pid"));
  EXPECT_THAT(test::refusal_of("valves = 'servo'\nsolver = 'servo_pid'\nservo = { effort = 1e-6 }"),
              HasSubstr("effort"));
  EXPECT_THAT(test::refusal_of("valves = 'two_way'\nsolver = 'end_position'\nend_position = { start_m = 1e-4, stop_m = "
                               "2e-4 }"),
              AllOf(HasSubstr("start_m"), HasSubstr("stop_m")));
}

}  // namespace
}  // namespace solenoid
