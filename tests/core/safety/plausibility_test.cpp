#include "core/safety/plausibility.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

/// Sound sensors of a slide moving slowly, with their noise; a test spoils some of them.
class SoundSensors {
 public:
  Sensors next() {
    const double t = 1e-3 * tick_++;
    return {t, 0.05 + 0.02 * std::sin(t) + 2e-5 * normal_(random_),
            150e3 + 2e3 * std::sin(3 * t) + 40 * normal_(random_), 140e3 + 40 * normal_(random_)};
  }

 private:
  int tick_ = 0;
  std::mt19937 random_{7};
  std::normal_distribution<double> normal_;
};

struct PlausibilityTest : testing::Test {
  Plausibility::Verdict check(const Sensors& s, std::array<double, 2> expected = {},
                              std::array<double, 3> innovations = {1, 1, 1}) {
    return plausibility.check(s, expected, innovations);
  }
  /// Ticks until the sensor has failed when `spoil` acts on every tick; -1: not within a second.
  template <class Spoil>
  int ticks_to_failure(Sensor sensor, SensorFault kind, Spoil spoil) {
    for (int i = 0; i < 500; ++i) check(sound.next());
    for (int i = 1; i <= 1000; ++i) {
      Sensors s = sound.next();
      spoil(s, i);
      const auto verdict = check(s);
      if (verdict.failed.any(sensor)) {
        EXPECT_TRUE(verdict.failed.has(sensor, kind)) << to_string(verdict.failed);
        return i;
      }
    }
    return -1;
  }
  PlausibilitySettings settings;
  Plausibility plausibility{settings, 101325, 251325};
  SoundSensors sound;
};

TEST_F(PlausibilityTest, BelievesSoundSensors) {
  for (int i = 0; i < 20'000; ++i) {
    const auto verdict = check(sound.next());
    ASSERT_TRUE(verdict.sound()) << i << " " << to_string(verdict.seen);
    ASSERT_TRUE(std::isfinite(verdict.sensors.position_m + verdict.sensors.pressure_a_pa));
  }
}

TEST_F(PlausibilityTest, FindsWhatASingleValueShowsAfterItsPatience) {
  const int patient = settings.patience_ticks + 1;
  EXPECT_EQ(
      ticks_to_failure(Sensor::position, SensorFault::not_finite, [](Sensors& s, int) { s.position_m = nan_value; }),
      patient);
  plausibility.reset();
  EXPECT_EQ(ticks_to_failure(Sensor::position, SensorFault::rail, [](Sensors& s, int) { s.position_m = 0.11; }),
            patient);
  plausibility.reset();
  EXPECT_EQ(ticks_to_failure(Sensor::position, SensorFault::range, [](Sensors& s, int) { s.position_m = -0.0097; }),
            patient);
  plausibility.reset();
  EXPECT_EQ(ticks_to_failure(Sensor::position, SensorFault::slew, [](Sensors& s, int) { s.position_m += 0.02; }),
            patient);
  plausibility.reset();
  EXPECT_EQ(ticks_to_failure(Sensor::pressure_a, SensorFault::rail, [](Sensors& s, int) { s.pressure_a_pa = 311325; }),
            patient);
  plausibility.reset();
  EXPECT_EQ(ticks_to_failure(Sensor::pressure_b, SensorFault::range, [](Sensors& s, int) { s.pressure_b_pa = 20e3; }),
            patient);
  plausibility.reset();
  EXPECT_EQ(ticks_to_failure(Sensor::pressure_b, SensorFault::slew,
                             [](Sensors& s, int i) { s.pressure_b_pa += i % 2 ? 5e5 : -5e5; }),
            patient);
}

TEST_F(PlausibilityTest, FindsValuesThatStopArriving) {
  EXPECT_EQ(ticks_to_failure(Sensor::position, SensorFault::stale, [](Sensors& s, int i) { s.stale_ticks = i; }),
            settings.stale_ticks + 1);
}

TEST_F(PlausibilityTest, FindsAStuckPotentiometerByItsMissingNoise) {
  double held = 0.0;
  const auto stick = [&](Sensors& s, int i) {
    if (i == 1) held = s.position_m;
    s.position_m = held;
  };
  EXPECT_EQ(ticks_to_failure(Sensor::position, SensorFault::stuck, stick), settings.stuck_ticks + 1);
}

TEST_F(PlausibilityTest, FindsAStuckPressureOnceTheModelMovesIt) {
  for (int i = 0; i < 2000; ++i) {  // blocked chambers may well show the same number for long
    Sensors s = sound.next();
    s.pressure_a_pa = 150e3;
    ASSERT_TRUE(check(s).failed.empty());
  }
  int ticks = 0;
  for (; ticks < 1000; ++ticks) {
    Sensors s = sound.next();
    s.pressure_a_pa = 150e3;
    if (check(s, {2e3, 0}).failed.has(Sensor::pressure_a, SensorFault::stuck)) break;
  }
  EXPECT_EQ(ticks, static_cast<int>(settings.stuck_pa / 2e3) + settings.stuck_lag_ticks);
}

TEST_F(PlausibilityTest, FindsPressuresThatNoChamberCanHold) {
  EXPECT_EQ(ticks_to_failure(Sensor::pressure_a, SensorFault::supply,
                             [](Sensors& s, int i) { s.pressure_a_pa = std::min(305e3, s.pressure_a_pa + 20e3 * i); }),
            settings.supply_ticks + 8);  // after the ramp that keeps the slew plausible
}

TEST_F(PlausibilityTest, FindsASensorAtOddsWithTheOthers) {
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(check(sound.next(), {}, {2, 2, 2}).sound());
  check(sound.next(), {}, {1e6, 1, 1});  // one outlier is none
  ASSERT_TRUE(check(sound.next()).failed.empty());
  int ticks = 1;
  while (ticks < 100 && check(sound.next(), {}, {1, 1, 80}).failed.empty()) ++ticks;
  EXPECT_LT(ticks, settings.innovation_ticks);
  EXPECT_TRUE(check(sound.next()).failed.has(Sensor::pressure_b, SensorFault::innovation));
}

TEST_F(PlausibilityTest, LeavesASingleBadValueOutAndGoesOn) {
  for (int i = 0; i < 5000; ++i) {
    Sensors s = sound.next();
    if (i % 100 == 99) s.position_m = nan_value;
    const auto verdict = check(s);
    ASSERT_TRUE(verdict.failed.empty()) << i;
    ASSERT_EQ(std::isfinite(verdict.sensors.position_m), i % 100 != 99);
  }
}

TEST_F(PlausibilityTest, FailsASensorThatIsOftenBadAndRemembersUntilReset) {
  EXPECT_GT(ticks_to_failure(Sensor::position, SensorFault::not_finite,
                             [](Sensors& s, int i) {
                               if (i % 10 == 0) s.position_m = nan_value;
                             }),
            0);
  for (int i = 0; i < 3000; ++i) {
    const auto verdict = check(sound.next());
    ASSERT_TRUE(verdict.failed.has(Sensor::position, SensorFault::not_finite));
    ASSERT_TRUE(std::isnan(verdict.sensors.position_m));
  }
  plausibility.reset();
  EXPECT_TRUE(check(sound.next()).sound());
}

TEST(FaultSet, NamesWhatItHolds) {
  FaultSet set;
  EXPECT_EQ(to_string(set), "none");
  set.add(Sensor::pressure_b, SensorFault::innovation);
  set.add(Sensor::position, SensorFault::not_finite);
  set.add(Fault::position_limit);
  set.add(Fault::aborted);
  EXPECT_EQ(to_string(set), "position not finite, pressure B innovation, position limit, aborted");
  EXPECT_TRUE(set.any(Sensor::position));
  EXPECT_FALSE(set.any(Sensor::pressure_a));
}

}  // namespace
}  // namespace solenoid
