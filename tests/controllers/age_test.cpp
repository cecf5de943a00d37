#include "controllers/estimators/extended_kalman.hpp"
#include "controllers/systems/actuator/estimators/kalman.hpp"
#include "tests/support/double_integrator.hpp"
#include "tests/support/drawn_world.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

constexpr double age_tick_s = 1e-3;
constexpr int most_age = 3;  // ticks
using AgedSlide = DoubleIntegrator;

/// A position sensor with the potentiometer's noise, on a mass that unknown forces push.
KalmanSetup<AgedSlide> aged_slide_setup(std::vector<int> delays) {
  KalmanSetup<AgedSlide> setup;
  for (const int delay : delays) setup.channels.push_back(KalmanChannel<AgedSlide>::of(0, 3e-5, 0.0, delay));
  setup.process_sigma = {0.0, 0.05};
  setup.start_sigma = {1e-4, 1e-2};
  setup.gate_sigmas = 1e9;
  return setup;
}

/// Root mean square errors of position and velocity.
struct SlideErrors {
  double position = 0.0, velocity = 0.0;
};

/// A mass that swings at up to 0.3 m/s. `age`: of each tick's value [ticks].
struct AgedRun {
  explicit AgedRun(std::uint64_t seed) : random(seed) {}

  /// Moves the mass by a tick under a known force and unknown ones; returns the known force.
  double advance() {
    const double force = 6.0 * std::cos(20e-3 * tick++);
    x = AgedSlide().step<double>(x, {force}, {0.0}, age_tick_s);
    x[1] += 0.05 * std::sqrt(age_tick_s) * normal(random);
    past.push_front(x[0]);
    return force;
  }
  double shown(double age) {
    const auto j = static_cast<std::size_t>(age);
    const double part = age - static_cast<double>(j);
    const double then = past[j] + (part > 0 ? part * (past[j + 1] - past[j]) : 0.0);
    return then + 3e-5 * normal(random);
  }

  std::mt19937_64 random;
  std::normal_distribution<double> normal;
  Vector<double, 2> x{0.0, 0.0};
  std::deque<double> past{0.0, 0.0, 0.0, 0.0, 0.0};
  int tick = 0;
};

/// Errors of three filters of the same values: one that is told the age, one that is not, and the exact filter of the
/// augmented system, for which the sensor is as many channels as there are ages, of which a tick brings one.
template <class Age>
std::array<SlideErrors, 3> errors_with(const Age& age_of) {
  constexpr int ticks = 40'000;
  AgedRun run(17);
  double newest = -1.0;  // when the newest value was measured: one that was overtaken does not arrive
  ExtendedKalman<AgedSlide> told({}, aged_slide_setup({0}), age_tick_s), untold({}, aged_slide_setup({0}), age_tick_s);
  ExtendedKalman<AgedSlide> exact({}, aged_slide_setup({0, 1, 2, 3}), age_tick_s);
  std::array<SlideErrors, 3> sums;
  for (int k = 0; k < ticks; ++k) {
    const double age = age_of(run.random), shown = run.shown(age);
    const double value = k - age > newest ? shown : std::numeric_limits<double>::quiet_NaN();
    newest = std::max(newest, k - age);
    std::array<double, 4> channels;
    channels.fill(std::numeric_limits<double>::quiet_NaN());
    channels[static_cast<std::size_t>(age)] = value;
    told.update(std::span(&value, 1), age * age_tick_s);
    untold.update(std::span(&value, 1));
    exact.update(channels);
    const std::array<Vector<double, 2>, 3> believed = {told.state(), untold.state(), exact.state()};
    for (std::size_t f = 0; f < 3 && k > 1000; ++f) {
      sums[f].position += std::pow(believed[f][0] - run.x[0], 2) / (ticks - 1001);
      sums[f].velocity += std::pow(believed[f][1] - run.x[1], 2) / (ticks - 1001);
    }
    const double force = run.advance();
    for (ExtendedKalman<AgedSlide>* filter : {&told, &untold, &exact}) filter->applied({force}, {0.0});
  }
  for (SlideErrors& e : sums) e = {std::sqrt(e.position), std::sqrt(e.velocity)};
  std::printf("position rms um: told %.2f, untold %.2f, exact %.2f; velocity mm/s: %.3f, %.3f, %.3f\n",
              1e6 * sums[0].position, 1e6 * sums[1].position, 1e6 * sums[2].position, 1e3 * sums[0].velocity,
              1e3 * sums[1].velocity, 1e3 * sums[2].velocity);
  return sums;
}

/// The optimum but for rounding, and at most a third of what it costs to ignore the age.
void expect_optimal(const std::array<SlideErrors, 3>& e) {
  EXPECT_LT(e[0].position, 1.001 * e[2].position);
  EXPECT_LT(e[0].velocity, 1.001 * e[2].velocity);
  EXPECT_LT(e[0].position, e[1].position / 3);
}

TEST(AgeOfMeasurements, AConstantOneIsTheAugmentedFilter) {
  for (const int ticks : {1, 2, most_age}) expect_optimal(errors_with([ticks](std::mt19937_64&) { return ticks; }));
}

TEST(AgeOfMeasurements, OneThatJittersByTicksToo) {
  expect_optimal(
      errors_with([](std::mt19937_64& random) { return std::uniform_int_distribution<int>(0, most_age)(random); }));
}

TEST(AgeOfMeasurements, FractionsOfATickAreInterpolated) {
  AgedRun run(23);
  ExtendedKalman<AgedSlide> told({}, aged_slide_setup({0}), age_tick_s), untold({}, aged_slide_setup({0}), age_tick_s);
  std::uniform_real_distribution<double> jitter(0.0, 2.0);
  double squares = 0.0, squares_untold = 0.0, newest = -1.0;
  for (int k = 0; k < 20'000; ++k) {
    const double age = jitter(run.random), shown = run.shown(age);
    const double value = k - age > newest ? shown : std::numeric_limits<double>::quiet_NaN();
    newest = std::max(newest, k - age);
    told.update(std::span(&value, 1), age * age_tick_s);
    untold.update(std::span(&value, 1));
    if (k > 1000) squares += std::pow(told.state()[0] - run.x[0], 2);
    if (k > 1000) squares_untold += std::pow(untold.state()[0] - run.x[0], 2);
    const double force = run.advance();
    told.applied({force}, {0.0});
    untold.applied({force}, {0.0});
  }
  EXPECT_LT(std::sqrt(squares / 18'999), 25e-6);  // 20 with whole ticks, above
  EXPECT_LT(squares, squares_untold / 9);
}

/// A value from before the filter began, or older than the ring, says nothing.
TEST(AgeOfMeasurements, WhatIsTooOldToCompareIsLeftOut) {
  ExtendedKalman<AgedSlide> filter({}, aged_slide_setup({0}), age_tick_s);
  const double far = 0.5;
  filter.update(std::span(&far, 1), 2 * age_tick_s);
  EXPECT_EQ(filter.state()[0], 0.0);
  for (int k = 0; k < 40; ++k) filter.update(std::span(&far, 1), 16.5 * age_tick_s);
  EXPECT_EQ(filter.state()[0], 0.0);
  EXPECT_EQ(filter.innovation(), 0.0);
  for (int k = 0; k < 12; ++k) filter.update(std::span(&far, 1), 15 * age_tick_s);
  EXPECT_EQ(filter.state()[0], 0.0);  // of before the filter stood there
  for (int k = 0; k < 3; ++k) filter.update(std::span(&far, 1), 15 * age_tick_s);
  EXPECT_GT(filter.state()[0], 0.01);
}

/// Where a filter stands when values are missing is as far back as their age usually is; that is forgotten.
TEST(AgeOfMeasurements, OneLateValueDoesNotDecideForTheRestOfTheRun) {
  using Late = LateValues<int>;
  Late late;
  const auto tick = [&](double age, bool any) {
    late.passed(0);
    const int back = late.aim(age, any);
    while (late.behind() > back) late.caught_up();
    return back;
  };
  for (int k = 0; k < 20; ++k) tick(1.0, true);
  EXPECT_EQ(tick(0.0, false), 1);
  for (int k = 0; k < 12; ++k) tick(0.0, false);  // a gap, ended by a value from just after its beginning
  tick(1.0, true);
  for (int k = 0; k < 9; ++k) tick(12.0, true);
  EXPECT_GE(tick(0.0, false), 2);
  for (int k = 0; k < 2 * Late::usual_values; ++k) tick(1.0, true);
  EXPECT_EQ(tick(0.0, false), 1);
  for (int k = 0; k < 30; ++k) EXPECT_EQ(tick(0.0, false), 1);
}

/// A filter whose first values are old stands where they belong: it says what one says that had them in time.
TEST(AgeOfMeasurements, TheActuatorsFilterStartsWhereItsValuesBelong) {
  const EstimatorTuning tuning = moderate_tuning();
  for (const int age : {1, 2, 5}) {
    DrawnWorld world(tuning, 11);
    ActuatorKalman prompt(PneumaticActuator(), tuning), late(PneumaticActuator(), tuning);
    struct Tick {
      Measurement sensors;
      ActuatorKalman prompt;
      SwitchedOf<PneumaticActuator> opening{};
      double motor_n = 0.0;
    };
    std::vector<Tick> ticks;
    Measurement none;
    none.value.fill(std::numeric_limits<double>::quiet_NaN());
    for (int k = 0; k < 200; ++k) {
      const Measurement now = world.sensors();
      prompt.update(now);
      ticks.push_back({now, prompt});
      if (k < age) {
        late.update(none);
      } else {
        const auto then = ticks.end() - 1 - age;
        Measurement old = then->sensors;
        old.age_s = age * tuning.tick_s;
        late.update(old);
        ActuatorKalman predicted = then->prompt;
        for (auto tick = then; tick != ticks.end() - 1; ++tick) {
          predicted.applied(tick->opening, tick->motor_n);
          predicted.update(none);
        }
        const Belief::State &says = late.belief().mean, &expected = predicted.belief().mean;
        ASSERT_LT((says - expected).norm(), 1e-12 * expected.norm()) << age << " at " << k;
        ASSERT_NEAR(says[velocity], expected[velocity], 1e-12) << age << " at " << k;
      }
      world.advance(now);
      ticks.back().opening = world.opening(), ticks.back().motor_n = world.motor_n();
      for (ActuatorKalman* filter : {&prompt, &late}) filter->applied(world.opening(), world.motor_n());
    }
    EXPECT_EQ(late.starts(), 1);
  }
}

/// The actuator's filter on worlds drawn from its own beliefs, whose values come up to 3 ms late.
TEST(AgeOfMeasurements, TheActuatorsFilterUsesItToo) {
  EstimatorTuning tuning = moderate_tuning();
  DrawnWorld world(tuning, 5);
  ActuatorKalman prompt(PneumaticActuator(), tuning), told(PneumaticActuator(), tuning),
      untold(PneumaticActuator(), tuning);
  std::mt19937_64 random(3);
  std::deque<Measurement> past;
  std::array<double, 3> squares{};
  double innovations = 0.0;
  int newest = -1, taken = 0;
  for (int k = 0; k < 6000; ++k) {
    const Measurement now = world.sensors();
    past.push_front(now);
    if (past.size() > most_age + 1) past.pop_back();
    const int age = std::min(k, std::uniform_int_distribution<int>(0, most_age)(random));
    Measurement late = past[static_cast<std::size_t>(age)];
    if (k - age <= newest) late.value.fill(std::numeric_limits<double>::quiet_NaN());
    newest = std::max(newest, k - age);
    untold.update(late);
    late.age_s = age * tuning.tick_s;
    told.update(late);
    innovations += told.innovation();
    taken += std::isfinite(late.value[position_channel]);
    prompt.update(now);
    const std::array<const ActuatorKalman*, 3> filters = {&prompt, &told, &untold};
    for (std::size_t f = 0; f < 3; ++f)
      squares[f] += std::pow(filters[f]->belief().mean[position] - world.truth()[position], 2);
    world.advance(now);
    for (ActuatorKalman* filter : {&prompt, &told, &untold}) filter->applied(world.opening(), world.motor_n());
  }
  std::printf("position rms um: prompt %.1f, told %.1f, untold %.1f\n", 1e6 * std::sqrt(squares[0] / 6000),
              1e6 * std::sqrt(squares[1] / 6000), 1e6 * std::sqrt(squares[2] / 6000));
  EXPECT_NEAR(innovations / taken, 3.0, 0.3);  // chi-square of three channels
  EXPECT_LT(std::sqrt(squares[1]), 2.0 * std::sqrt(squares[0]));
  EXPECT_LT(std::sqrt(squares[1]), std::sqrt(squares[2]) / 3);
  EXPECT_EQ(told.starts(), 1);
}

}  // namespace
}  // namespace solenoid
