#include "controllers/systems/actuator/resting_slide.hpp"

#include "core/systems/actuator/signals.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

constexpr double resting_tick_s = 1e-3, resting_step_m = 0.12 / 8192, found_m = 3e-4;

double resting_shown(double position_m) { return resting_step_m * std::round(position_m / resting_step_m); }

/// A slide under any load that the rig may carry, pushed by a motor force that wanders, sometimes fast, between its
/// limits.
struct PushedSlide {
  explicit PushedSlide(std::uint64_t seed) : random(seed) {
    const auto between = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
    conditions = model.conditions<double>(between(0.0, 0.15), between(-2.0, 2.0), between(0.5, 2.0));
    gain = between(0.02, 0.3);
  }
  void advance() {
    const double pull = 300.0 * (0.05 - x[position]);  // keeps it about the middle, where stops are far
    motor = std::clamp(0.99 * motor + gain * std::normal_distribution<double>()(random) + 0.01 * pull, -8.0, 8.0);
    x = model.step_under<double>(x, {0, 0, 0, 0}, {motor}, resting_tick_s, conditions);
  }

  PneumaticActuator model;
  std::mt19937_64 random;
  PneumaticActuator::Conditions<double> conditions;
  double gain, motor = 0.0;
  ActuatorState x{0.05, 0.0, 150e3, 150e3};
};

TEST(RestingSlide, SaysNothingOfASensorThatShowsWhatTheSlideDoes) {
  int rested = 0, moved = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    PushedSlide slide(seed);
    RestingSlide watch(slide.model, resting_tick_s);
    double last = NAN, must_have = 0.0;
    for (int k = 0; k < 20'000; ++k) {
      slide.advance();
      const double now = resting_shown(slide.x[position]);
      watch.advance(now, slide.x[pressure_a], slide.x[pressure_b], slide.motor);
      must_have = now == last ? must_have + watch.moved_m() : 0.0;
      ASSERT_LT(std::abs(must_have), found_m) << seed << " at " << k;
      (now == last ? rested : moved) += 1;
      last = now;
    }
  }
  EXPECT_GT(rested, 10'000);
  EXPECT_GT(moved, 10'000);
}

TEST(RestingSlide, FindsTheSensorStuckOnceTheDriveHasSwungBeyondFrictionWhateverTheLoad) {
  const PneumaticActuator model;
  const double band = 4 * model.parameters().static_friction_n;
  for (const double swing : {0.5 * band, 0.9 * band, 1.5 * band, 2.0 * band})
    for (const double sign : {-1.0, 1.0}) {
      RestingSlide watch(model, resting_tick_s);
      const double from = -sign * swing / 2;
      double moved = 0.0, ticks = 0;
      watch.advance(0.05, 150e3, 150e3, from);
      for (; ticks < 1000 && std::abs(moved) < found_m; ++ticks) {
        watch.advance(0.05, 150e3, 150e3, from + sign * swing);
        moved += watch.moved_m();
      }
      if (swing < band) {
        EXPECT_EQ(moved, 0.0);
        continue;
      }
      // found_m = (swing - band) t^2 / 2m
      const double inverse_mass = model.conditions<double>(RestingSlide::most_payload_kg, 0.0, 1.0).inverse_mass;
      EXPECT_NEAR(resting_tick_s * ticks, std::sqrt(2 * found_m / (inverse_mass * (swing - band))), 2 * resting_tick_s);
      EXPECT_EQ(moved > 0, sign > 0);
    }
}

TEST(RestingSlide, IsSilentAtTheEndStopsAndForgetsWhenThePositionChanges) {
  const PneumaticActuator model;
  const ActuatorParameters& p = model.parameters();
  for (const double at : {p.position_min_m(), p.position_max_m()}) {
    RestingSlide watch(model, resting_tick_s);
    for (int k = 0; k < 1000; ++k) {
      watch.advance(at, 150e3, 150e3, k % 200 < 100 ? -8.0 : 8.0);
      ASSERT_EQ(watch.moved_m(), 0.0);
    }
  }
  RestingSlide watch(model, resting_tick_s);
  watch.advance(0.05, 150e3, 150e3, -8.0);
  watch.advance(NAN, 150e3, 150e3, 8.0);  // a missing value is no change
  EXPECT_GT(watch.moved_m(), 0.0);
  watch.advance(0.05 + resting_step_m, 150e3, 150e3, 8.0);
  EXPECT_EQ(watch.moved_m(), 0.0);
  watch.advance(0.05 + resting_step_m, 150e3, 150e3, 8.0);
  EXPECT_EQ(watch.moved_m(), 0.0);
}

}  // namespace
}  // namespace solenoid
