// The servo valve's physics: spool, play, overlap, leakage (core/systems/actuator/servo_valve.hpp).
#include "core/systems/actuator/servo_valve.hpp"

#include "core/config/reader.hpp"
#include "core/systems/actuator/dynamics.hpp"
#include "core/systems/actuator/valves.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using ::testing::HasSubstr;

/// No hysteresis.
ServoValve smooth_valve() {
  ServoValve valve;
  valve.hysteresis = 0.0;
  return valve;
}

TEST(ServoValve, SpoolStepResponseIsTheClosedForm) {
  const ServoValve valve = smooth_valve();
  const double w = 2 * std::numbers::pi * valve.frequency_hz, zeta = valve.damping;
  const double swing = w * std::sqrt(1 - zeta * zeta), phase = std::acos(zeta);
  Spool spool;
  spool.command(valve, 0.6);
  const SpoolStep tick(valve, 1e-4);
  for (int i = 1; i <= 400; ++i) {
    spool = spool.after(tick);
    const double t = 1e-4 * i, envelope = std::exp(-zeta * w * t);
    // Textbook: 1 - e^(-zeta w t) sin(w_d t + phi)/sqrt(1 - zeta^2), cos phi = zeta.
    const double response = 1 - envelope * std::sin(swing * t + phase) / std::sqrt(1 - zeta * zeta);
    EXPECT_NEAR(spool.x, 0.6 * response, 1e-12) << t;
    EXPECT_NEAR(spool.v, 0.6 * envelope * w * std::sin(swing * t) / std::sqrt(1 - zeta * zeta), 1e-9) << t;
  }
}

TEST(ServoValve, AtItsFrequencyThreeDecibelsAreLostAndAQuarterOfATurn) {
  const ServoValve valve = smooth_valve();
  constexpr int steps_a_turn = 4000;
  const double dt = 1.0 / (valve.frequency_hz * steps_a_turn);
  const SpoolStep step(valve, dt);
  Spool spool;
  double in_phase = 0.0, quadrature = 0.0;
  for (int i = 0; i < 20 * steps_a_turn; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.5) / steps_a_turn;  // the command's mean over the step
    spool.command(valve, 0.5 * std::sin(angle));
    spool = spool.after(step);
    if (i < 19 * steps_a_turn) continue;
    const double at_end = angle + std::numbers::pi / steps_a_turn;
    in_phase += 2.0 / steps_a_turn * spool.x * std::sin(at_end);
    quadrature += 2.0 / steps_a_turn * spool.x * std::cos(at_end);
  }
  EXPECT_NEAR(std::hypot(in_phase, quadrature), 0.5 * std::numbers::sqrt2 / 2, 1e-5);
  EXPECT_NEAR(std::atan2(quadrature, in_phase), -std::numbers::pi / 2, 1e-5);
}

TEST(ServoValve, WithoutFrequencyTheSpoolIsWhereItIsTold) {
  ServoValve valve = smooth_valve();
  valve.frequency_hz = 0.0;
  Spool spool;
  spool.command(valve, -0.4);
  spool = spool.after(SpoolStep(valve, 1e-3));
  EXPECT_EQ(spool.x, -0.4);
  EXPECT_EQ(spool.v, 0.0);
}

TEST(ServoValve, HysteresisIsThePlayOperator) {
  ServoValve valve;
  valve.hysteresis = 0.2;
  Spool spool;
  const auto target_at = [&](double c) {
    spool.command(valve, c);
    return spool.target;
  };
  EXPECT_NEAR(target_at(0.09 / 1.1), 0.0, 1e-15);  // inside the play nothing moves
  EXPECT_NEAR(target_at(0.5), 0.55 - 0.1, 1e-15);
  EXPECT_NEAR(target_at(0.45), 0.45, 1e-15);  // back by less than the play
  EXPECT_NEAR(target_at(0.2), 0.22 + 0.1, 1e-15);
  EXPECT_NEAR(target_at(1.0), 1.0, 1e-15);  // full either way
  EXPECT_NEAR(target_at(-1.0), -1.0, 1e-15);
  EXPECT_NEAR(target_at(-7.0), -1.0, 1e-15);
  EXPECT_NEAR(target_at(std::nan("")), -1.0, 1e-15);
  // A loop up and down between +-0.5: its width is the play at every command on both branches.
  const auto branch = [&](double from, double to, double at) {
    for (double c = from; (to - from) * (at - c) > 0.0; c += (to - from) / 1000) target_at(c);
    return target_at(at);
  };
  target_at(0.5), target_at(-0.5);
  const double up = branch(-0.5, 0.5, 0.1);
  target_at(0.5);
  const double down = branch(0.5, -0.5, 0.1);
  EXPECT_NEAR(down - up, valve.hysteresis, 1e-12);
}

TEST(ServoValve, OverlapKeepsAPathShutButForItsLeak) {
  const ServoValve valve;
  EXPECT_EQ(valve.opening(0.0), valve.leakage);
  EXPECT_EQ(valve.opening(valve.dead_band), valve.leakage);
  EXPECT_EQ(valve.opening(-valve.leakage_width), 0.0);
  EXPECT_EQ(valve.opening(-1.0), 0.0);
  EXPECT_NEAR(valve.opening(-valve.leakage_width / 2), valve.leakage / 2, 1e-15);
  EXPECT_NEAR(valve.opening(0.5), (0.5 - valve.dead_band) / (1 - valve.dead_band), 1e-15);
  double before = valve.opening(-1.5);
  for (double x = -1.5; x <= 1.5; x += 1e-3) {  // never down, never by a jump
    const double now = valve.opening(x);
    EXPECT_GE(now, before);
    EXPECT_LT(now - before, 2e-3);
    before = now;
  }
  EXPECT_EQ(valve.opening(1.2), 1.0);  // the overshoot of a full step opens no wider
}

TEST(ServoValve, LargestFlowIsTheOnOffValves) {
  const ActuatorParameters p;
  const ModeSet two_way = valve_modes("two_way", p);
  ServoPair pair(p.servo, 1e-3);
  std::array<double, 4> opening{};
  for (int tick = 0; tick < 200; ++tick) {
    opening = pair.openings(1.0, -1.0);
    pair.advance();
  }
  const auto on_off = two_way.point(0b1001);  // fill A, exhaust B
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(opening[i], on_off[i], 1e-12);
}

TEST(ServoPair, MayBeToldAgainInATick) {
  const ServoValve valve;
  ServoPair twice(valve, 1e-3), once(valve, 1e-3);
  for (int tick = 0; tick < 30; ++tick) {
    const double a = std::sin(0.3 * tick), b = std::cos(0.2 * tick);
    twice.openings(0.9, -0.9);
    EXPECT_EQ(twice.openings(a, b), once.openings(a, b));
    twice.advance(), once.advance();
    EXPECT_EQ(twice.state(), once.state());
  }
}

TEST(ServoValve, TheConfigurationHasOneModeAndNoSwitch) {
  const ModeSet modes = valve_modes(servo_valves, {});
  EXPECT_EQ(modes.switch_count(), 0);
  ASSERT_EQ(modes.size(), 1);
  EXPECT_EQ(modes.pattern(0), 0u);
  for (const double opening : modes.point(0)) EXPECT_EQ(opening, 0.0);
  DelayLines lines(modes.safe_pattern());
  const SwitchTiming timing(modes, 1e-3);
  lines.command(0, timing);
  EXPECT_EQ(lines.effective(), 0u);
  EXPECT_EQ(timing.longest_delay, 0);
}

TEST(ServoValve, ParametersAreReadAndRefusedByName) {
  const auto read = [](const std::string& text) {
    TableReader table = TableReader::from_text(text, "servo.toml");
    return read_parameters(table);
  };
  const auto refusal = [&](const std::string& text) -> std::string {
    try {
      read(text);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "not refused";
  };
  EXPECT_EQ(read("servo = { dead_band = 0.02, frequency_hz = 80 }").servo.dead_band, 0.02);
  EXPECT_EQ(read("").servo, ServoValve{});
  EXPECT_THAT(refusal("servo = { deadband = 0.02 }"), HasSubstr("deadband"));
  EXPECT_THAT(refusal("servo = { damping = 1.0 }"), HasSubstr("damping"));
  EXPECT_THAT(refusal("servo = { dead_band = 0.6 }"), HasSubstr("allowed: "));
  ActuatorParameters p;
  p.servo.leakage = std::nan("");
  EXPECT_THROW(p.validate("here"), ConfigError);
  EXPECT_EQ((Mismatch{.delay = 2.0}).applied_to({}).servo.frequency_hz, ServoValve{}.frequency_hz / 2);
}

}  // namespace
}  // namespace solenoid
