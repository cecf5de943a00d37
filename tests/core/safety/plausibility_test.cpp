#include "core/safety/plausibility.hpp"

#include "core/systems/actuator/signals.hpp"

#include <bit>
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
  Measurement next() {
    const double t = 1e-3 * tick_++;
    const double y = 0.05 + 0.02 * std::sin(t) + 2e-5 * normal_(random_);
    const double a = 150e3 + 2e3 * std::sin(3 * t) + 40 * normal_(random_), b = 140e3 + 40 * normal_(random_);
    return {.time_s = t, .value = {y, a, b}};
  }

 private:
  int tick_ = 0;
  std::mt19937 random_{7};
  std::normal_distribution<double> normal_;
};

/// A potentiometer and two pressures between atmosphere and supply, as the thesis's rig has them.
PlausibilitySettings three_channels() {
  SensorBounds position{-0.0095, 0.1095, -0.01, 0.11, 3e-5, 2.5e-3, 3e-5};
  position.stuck_ticks = 100;
  SensorBounds pressure{60e3, 310e3, 101325.0 - 210e3, 101325.0 + 210e3, 1e3, 30e3, 150.0};
  pressure.stuck_change = 25e3;
  pressure.supply_low = 101325 - 50e3, pressure.supply_high = 251325 + 50e3;
  PlausibilitySettings settings;
  settings.channels = {position, pressure, pressure};
  return settings;
}

struct PlausibilityTest : testing::Test {
  Plausibility::Verdict check(const Measurement& s, const ChannelValues& expected = {},
                              const ChannelValues& innovations = {1, 1, 1}) {
    return plausibility.check(s, expected, innovations);
  }
  /// Ticks until the sensor has failed when `spoil` acts on every tick; -1: not within a second.
  template <class Spoil>
  int ticks_to_failure(std::size_t sensor, SensorFault kind, Spoil spoil) {
    for (int i = 0; i < 500; ++i) check(sound.next());
    for (int i = 1; i <= 1000; ++i) {
      Measurement s = sound.next();
      spoil(s, i);
      const auto verdict = check(s);
      if (verdict.failed.any(sensor)) {
        EXPECT_TRUE(verdict.failed.has(sensor, kind)) << to_string(verdict.failed, actuator_description());
        return i;
      }
    }
    return -1;
  }
  PlausibilitySettings settings = three_channels();
  Plausibility plausibility{settings};
  SoundSensors sound;
};

TEST_F(PlausibilityTest, BelievesSoundSensors) {
  for (int i = 0; i < 20'000; ++i) {
    const auto verdict = check(sound.next());
    ASSERT_TRUE(verdict.sound()) << i << " " << to_string(verdict.seen, actuator_description());
    ASSERT_TRUE(std::isfinite(verdict.measured.value[position_channel] + verdict.measured.value[pressure_a_channel]));
  }
}

TEST_F(PlausibilityTest, FindsWhatASingleValueShowsAfterItsPatience) {
  const int patient = settings.patience_ticks + 1;
  EXPECT_EQ(ticks_to_failure(position_channel, SensorFault::not_finite,
                             [](Measurement& s, int) { s.value[position_channel] = nan_value; }),
            patient);
  plausibility.reset();
  EXPECT_EQ(ticks_to_failure(position_channel, SensorFault::rail,
                             [](Measurement& s, int) { s.value[position_channel] = 0.11; }),
            patient);
  plausibility.reset();
  EXPECT_EQ(ticks_to_failure(position_channel, SensorFault::range,
                             [](Measurement& s, int) { s.value[position_channel] = -0.0097; }),
            patient);
  plausibility.reset();
  EXPECT_EQ(ticks_to_failure(position_channel, SensorFault::slew,
                             [](Measurement& s, int) { s.value[position_channel] += 0.02; }),
            patient);
  plausibility.reset();
  EXPECT_EQ(ticks_to_failure(pressure_a_channel, SensorFault::rail,
                             [](Measurement& s, int) { s.value[pressure_a_channel] = 311325; }),
            patient);
  plausibility.reset();
  EXPECT_EQ(ticks_to_failure(pressure_b_channel, SensorFault::range,
                             [](Measurement& s, int) { s.value[pressure_b_channel] = 20e3; }),
            patient);
  plausibility.reset();
  EXPECT_EQ(ticks_to_failure(pressure_b_channel, SensorFault::slew,
                             [](Measurement& s, int i) { s.value[pressure_b_channel] += i % 2 ? 5e5 : -5e5; }),
            patient);
}

TEST_F(PlausibilityTest, FindsValuesThatStopArriving) {
  EXPECT_EQ(ticks_to_failure(position_channel, SensorFault::stale, [](Measurement& s, int i) { s.stale_ticks = i; }),
            settings.stale_ticks + 1);
}

TEST_F(PlausibilityTest, FindsAStuckPotentiometerByItsMissingNoise) {
  double held = 0.0;
  const auto stick = [&](Measurement& s, int i) {
    if (i == 1) held = s.value[position_channel];
    s.value[position_channel] = held;
  };
  EXPECT_EQ(ticks_to_failure(position_channel, SensorFault::stuck, stick), settings.channels[0].stuck_ticks + 1);
}

TEST_F(PlausibilityTest, FindsAStuckPressureOnceTheModelMovesIt) {
  for (int i = 0; i < 2000; ++i) {  // blocked chambers may well show the same number for long
    Measurement s = sound.next();
    s.value[pressure_a_channel] = 150e3;
    ASSERT_TRUE(check(s).failed.empty());
  }
  int ticks = 0;
  for (; ticks < 1000; ++ticks) {
    Measurement s = sound.next();
    s.value[pressure_a_channel] = 150e3;
    if (check(s, {0, 2e3, 0}).failed.has(pressure_a_channel, SensorFault::stuck)) break;
  }
  EXPECT_EQ(ticks, static_cast<int>(settings.channels[1].stuck_change / 2e3) + settings.stuck_lag_ticks);
}

TEST_F(PlausibilityTest, FindsPressuresThatNoChamberCanHold) {
  EXPECT_EQ(ticks_to_failure(pressure_a_channel, SensorFault::supply,
                             [](Measurement& s, int i) {
                               s.value[pressure_a_channel] = std::min(305e3, s.value[pressure_a_channel] + 20e3 * i);
                             }),
            settings.supply_ticks + 8);  // after the ramp that keeps the slew plausible
}

TEST_F(PlausibilityTest, FindsASensorAtOddsWithTheOthers) {
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(check(sound.next(), {}, {2, 2, 2}).sound());
  check(sound.next(), {}, {1e6, 1, 1});  // one outlier is none
  ASSERT_TRUE(check(sound.next()).failed.empty());
  int ticks = 1;
  while (ticks < 100 && check(sound.next(), {}, {1, 1, 80}).failed.empty()) ++ticks;
  EXPECT_LT(ticks, settings.innovation_ticks);
  EXPECT_TRUE(check(sound.next()).failed.has(pressure_b_channel, SensorFault::innovation));
}

TEST_F(PlausibilityTest, LeavesASingleBadValueOutAndGoesOn) {
  for (int i = 0; i < 5000; ++i) {
    Measurement s = sound.next();
    if (i % 100 == 99) s.value[position_channel] = nan_value;
    const auto verdict = check(s);
    ASSERT_TRUE(verdict.failed.empty()) << i;
    ASSERT_EQ(std::isfinite(verdict.measured.value[position_channel]), i % 100 != 99);
  }
}

TEST_F(PlausibilityTest, FailsASensorThatIsOftenBadAndRemembersUntilReset) {
  EXPECT_GT(ticks_to_failure(position_channel, SensorFault::not_finite,
                             [](Measurement& s, int i) {
                               if (i % 10 == 0) s.value[position_channel] = nan_value;
                             }),
            0);
  for (int i = 0; i < 3000; ++i) {
    const auto verdict = check(sound.next());
    ASSERT_TRUE(verdict.failed.has(position_channel, SensorFault::not_finite));
    ASSERT_TRUE(std::isnan(verdict.measured.value[position_channel]));
  }
  plausibility.reset();
  EXPECT_TRUE(check(sound.next()).sound());
}

/// The values of a quantity that rests: noise of `sigma` through a converter of `quantum`, at a place within its step.
class RestingChannel {
 public:
  RestingChannel(const ChannelNoise& noise, double place, std::uint64_t seed)
      : noise_(noise), at_(0.05 + place * noise.quantum), random_(seed) {}
  double next() {
    const double value = at_ + noise_.sigma * normal_(random_);
    return noise_.quantum > 0 ? 0.05 + noise_.quantum * std::round((value - 0.05) / noise_.quantum) : value;
  }

 private:
  ChannelNoise noise_;
  double at_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

Plausibility watching_by(int stuck_ticks, double slew_per_tick = 1.0) {
  PlausibilitySettings settings;
  settings.channels = {SensorBounds{0.0, 1.0, -1.0, 2.0, 1e-3, slew_per_tick, 1e-3}};
  settings.channels[0].stuck_ticks = stuck_ticks;
  return Plausibility(settings);
}

TEST(StuckTicks, GiveNoFalseAlarmInAMillionTicksOfRestAndFindWhatIsStuckInTime) {
  constexpr double quantum = 15e-6;
  for (const double share : {0.25, 0.3, 0.5, 1.0, 1.4, 3.0, 10.0}) {
    const ChannelNoise noise{share * quantum, quantum};
    const int ticks = stuck_ticks_of(noise);
    ASSERT_GT(ticks, 1) << share;
    ASSERT_LE(ticks, most_stuck_ticks) << share;
    for (const double place : {0.0, 0.23, 0.5}) {
      Plausibility plausibility = watching_by(ticks);
      RestingChannel channel(noise, place, 3);
      for (int k = 0; k < 1'000'000; ++k)
        ASSERT_TRUE(plausibility.check({.value = {channel.next()}}, {}, {}).failed.empty()) << share << " at " << k;
      const double held = channel.next();
      int found = 0;
      while (plausibility.check({.value = {held}}, {}, {}).failed.empty()) ++found;
      EXPECT_LE(found, ticks) << share;
    }
  }
}

/// Runs of m + 1 equal values begin as often as p^m says.
TEST(StuckTicks, TheirProbabilityIsThatOfTheRunsThatNoiseMakes) {
  constexpr int ticks = 2'000'000;
  for (const auto& [share, m] : {std::pair{0.5, 12}, {1.0, 5}, {2.0, 3}}) {
    const ChannelNoise noise{share, 1.0};
    RestingChannel channel(noise, 0.0, 11);
    const double p = std::erf(1.0 / (std::sqrt(8.0) * share));
    int in_step = 0, runs = 0;
    for (int k = 0; k < ticks; ++k) {
      in_step = channel.next() == 0.05 ? in_step + 1 : 0;
      runs += in_step >= m;
    }
    const double expected = std::pow(p, m) * ticks;
    EXPECT_NEAR(runs, expected, 5 * std::sqrt(expected * 2 / (1 - p))) << share;  // of runs that overlap
    const double n = std::log(stuck_false_alarm_ticks) / -std::log(p);
    EXPECT_EQ(stuck_ticks_of(noise), static_cast<int>(std::ceil(n)));
    EXPECT_NEAR(stuck_ticks_of({share, 1.0, 7.0}), 7 * n, 1.0);
  }
}

TEST(StuckTicks, SayNothingWhereRestMayLastForEver) {
  EXPECT_EQ(stuck_ticks_of({0.0, 1.0}), 0);
  EXPECT_EQ(stuck_ticks_of({0.0, 0.0}), 0);
  EXPECT_EQ(stuck_ticks_of({0.1, 1.0}), 0);  // a step ten times as wide as the noise
  EXPECT_EQ(stuck_ticks_of({0.1, 0.0}), 2);
  for (const double ratio : {16.0, 16.6, 17.0, 50.0, 76.0, 77.0, 100.0, 1e6, 1e300})
    EXPECT_EQ(stuck_ticks_of({1.0, ratio}), 0) << ratio;
  EXPECT_EQ(stuck_ticks_of({1e-300, 1e300}), 0);
  for (double ratio = 1e-9; ratio < 1e6; ratio *= 1.1) {  // the wider the step, the longer: until never
    const int now = stuck_ticks_of({1.0, ratio}), wider = stuck_ticks_of({1.0, 1.1 * ratio});
    EXPECT_GE(wider == 0 ? most_stuck_ticks + 1 : wider, now == 0 ? most_stuck_ticks + 1 : now) << ratio;
  }
  Plausibility plausibility = watching_by(0);
  for (int k = 0; k < 1'000'000; ++k) ASSERT_TRUE(plausibility.check({.value = {0.05}}, {}, {}).sound()) << k;
}

/// Whether a Plausibility would take this value next.
bool takes(Plausibility plausibility, double value, double age_s) {
  return plausibility.check({.value = {value}, .age_s = age_s}, {}, {}).sound();
}

TEST(AgeInPlausibility, AYoungerSampleMayHaveMovedForLongerAndAnOlderOneForLess) {
  // 1 mm a tick.
  Plausibility younger = watching_by(0, 1e-3);
  ASSERT_TRUE(younger.check({.value = {0.5}, .age_s = 2e-3}, {}, {}).sound());
  EXPECT_TRUE(takes(younger, 0.5029, 0.0));  // 3 ms lie between the two
  EXPECT_FALSE(takes(younger, 0.5031, 0.0));
  Plausibility older = watching_by(0, 1e-3);
  ASSERT_TRUE(older.check({.value = {0.5}}, {}, {}).sound());
  EXPECT_TRUE(takes(older, 0.5006, 0.3e-3));  // 0.7 ms
  EXPECT_FALSE(takes(older, 0.5008, 0.3e-3));
  EXPECT_TRUE(takes(older, 0.5004, 0.9e-3));  // 0.1 ms, of which ages are not so sure
  EXPECT_FALSE(takes(older, 0.5006, 0.9e-3));
  Plausibility same = watching_by(0, 1e-3);
  ASSERT_TRUE(same.check({.value = {0.5}, .age_s = 2e-3}, {}, {}).sound());
  EXPECT_TRUE(same.check({.value = {0.5011}, .age_s = 2e-3}, {}, {}).seen.has(0, SensorFault::slew));
}

/// Values that come as an I/O with a clock of its own gives them, in the order in which they were measured.
TEST(AgeInPlausibility, AllowsTheMotionOfTheTimeBetweenTheTwoMeasurements) {
  constexpr double tick_s = 1e-3, most_m_s = 1.0, tolerance = 1e-6;
  const double least_s = PlausibilitySettings().jitter_ticks * tick_s;
  for (const unsigned seed : {1u, 2u, 3u}) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> draw(0.0, 1.0);
    Plausibility plausibility = watching_by(0, most_m_s * tick_s);
    double age = 0.0, value = 0.5;
    ASSERT_TRUE(plausibility.check({.value = {value}}, {}, {}).sound());
    for (int k = 0; k < 10'000; ++k) {
      const double next_age = draw(random) * std::min(5e-3, age + tick_s);
      const double between = std::max(least_s, tick_s + age - next_age);
      const double sign = value < 0.5 ? 1.0 : -1.0;
      ASSERT_FALSE(takes(plausibility, value + sign * most_m_s * between * (1 + tolerance), next_age)) << k;
      value += sign * most_m_s * between * (1 - tolerance);
      age = next_age;
      ASSERT_TRUE(plausibility.check({.value = {value}, .age_s = age}, {}, {}).sound()) << seed << " at " << k;
    }
  }
}

/// Ticks without a value make a jump little more plausible, and none where the value is as old as the wait.
TEST(AgeInPlausibility, WaitingCountsByTheTimeBetweenTheTwoMeasurementsToo) {
  for (int missed = 1; missed <= 3; ++missed)
    for (int older = 0; older <= missed; ++older) {
      Plausibility plausibility = watching_by(0, 1e-3);
      ASSERT_TRUE(plausibility.check({.value = {0.5}}, {}, {}).sound());
      for (int k = 1; k <= missed; ++k) plausibility.check({.value = {0.5}, .stale_ticks = k}, {}, {});
      const double allowed = 1e-3 * (1.0 + 0.2 * (missed - older));
      EXPECT_TRUE(takes(plausibility, 0.5 + 0.999 * allowed, 1e-3 * older)) << missed << " " << older;
      EXPECT_FALSE(takes(plausibility, 0.5 + 1.001 * allowed, 1e-3 * older)) << missed << " " << older;
    }
}

TEST(FaultSet, NamesWhatItHolds) {
  FaultSet set;
  EXPECT_EQ(to_string(set, actuator_description()), "none");
  set.add(pressure_b_channel, SensorFault::innovation);
  set.add(position_channel, SensorFault::not_finite);
  set.add(Fault::axis_limit);
  set.add(Fault::aborted);
  EXPECT_EQ(to_string(set, actuator_description()),
            "position not finite, pressure B innovation, position limit, aborted");
  EXPECT_TRUE(set.any(position_channel));
  EXPECT_FALSE(set.any(pressure_a_channel));
}

TEST(FaultSet, KeepsTheChannelsOfAnySystemApart) {
  for (std::size_t channel = 0; channel < max_channels; ++channel)
    for (int kind = 0; kind < sensor_fault_kinds; ++kind) {
      FaultSet set;
      set.add(channel, static_cast<SensorFault>(kind));
      EXPECT_EQ(std::popcount(set.bits()), 1);
      for (std::size_t other = 0; other < max_channels; ++other) EXPECT_EQ(set.any(other), other == channel);
      for (int fault = 0; fault < other_faults; ++fault) EXPECT_FALSE(set.has(static_cast<Fault>(fault)));
    }
}

}  // namespace
}  // namespace solenoid
