#include "core/metrics/percentile_sketch.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "core/signal/filters.hpp"
#include "core/systems/actuator/valves.hpp"

#include <complex>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// The frequency response at f by the Fourier sum of the impulse response.
std::complex<double> response(double f_hz) {
  Butterworth2 filter(50.0, 1000.0);
  std::complex<double> sum = 0;
  for (int n = 0; n < 2000; ++n)
    sum += filter.step(n == 0 ? 1.0 : 0.0) * std::polar(1.0, -2 * std::numbers::pi * f_hz * n / 1000.0);
  return sum;
}

TEST(Butterworth, HalvesThePowerAtItsCutOffAndLagsByFourAndAHalfMilliseconds) {
  EXPECT_NEAR(std::norm(response(50.0)), 0.5, 1e-9);
  EXPECT_NEAR(response(0.0).real(), 1.0, 1e-12);
  EXPECT_NEAR(1e3 * -std::arg(response(0.1)) / (2 * std::numbers::pi * 0.1), 4.5, 0.1);
  Butterworth2 filter(50.0, 1000.0);
  filter.reset(0.07);
  for (int i = 0; i < 10; ++i) EXPECT_NEAR(filter.step(0.07), 0.07, 1e-15);
}

TEST(Quantiser, RoundsToLevelsAndSaturates) {
  const Quantiser q(-1.0, 1.0, 3);
  EXPECT_DOUBLE_EQ(q.step(), 2.0 / 7);
  for (double x = -1; x <= 1; x += 0.01) EXPECT_LE(std::abs(q(x) - x), q.step() / 2 + 1e-12);
  EXPECT_EQ(q(5.0), 1.0);
  EXPECT_EQ(q(-5.0), -1.0);
}

TEST(BackwardDifference, IsExactOnALine) {
  BackwardDifference d(1e-3);
  d.reset(0.5);
  EXPECT_EQ(d.step(0.5), 0.0);
  EXPECT_NEAR(d.step(0.502), 2.0, 1e-12);
}

TEST(Percentiles, AreOfTheNearestRank) {
  std::vector<double> sample;
  for (int i = 1000; i >= 1; --i) sample.push_back(i);
  const Percentiles p = percentiles(sample);
  EXPECT_EQ(p.p50, 500);
  EXPECT_EQ(p.p90, 900);
  EXPECT_EQ(p.p99, 990);
  EXPECT_EQ(p.p999, 999);
  EXPECT_EQ(p.max, 1000);
}

TEST(PercentileSketch, IsWithinItsAccuracyOfTheNearestRank) {
  std::mt19937 random(11);
  std::lognormal_distribution<double> times(3.0, 2.0);
  PercentileSketch sketch;
  EXPECT_EQ(sketch.percentiles().p50, 0);
  std::vector<double> sample(50'000);
  for (double& x : sample) sketch.add(x = times(random));
  sketch.add(std::numeric_limits<double>::quiet_NaN());
  const Percentiles p = sketch.percentiles(), q = percentiles(sample);
  for (const auto& [found, exact] : {std::pair{p.p50, q.p50}, {p.p90, q.p90}, {p.p99, q.p99}, {p.p999, q.p999}})
    EXPECT_NEAR(found, exact, 1.0001 * PercentileSketch::accuracy * exact);
  EXPECT_EQ(p.max, q.max);
}

TEST(PercentileSketch, TakesWhatIsNoTime) {
  PercentileSketch sketch;
  for (const double x : {-5.0, 0.0, 1e-30, 1e300, std::numeric_limits<double>::infinity()}) sketch.add(x);
  const Percentiles p = sketch.percentiles();
  EXPECT_EQ(p.p50, 0.0);
  EXPECT_NEAR(p.p90, 1e12, 1e12 * PercentileSketch::accuracy);
  EXPECT_EQ(p.max, std::numeric_limits<double>::infinity());
}

TEST(CommandLimits, ReplaceWhatIsRefusedAndCountIt) {
  CommandLimits limits(valve_modes("two_way", {}), {8.0});
  EXPECT_EQ(limits.checked({0b1001, {3.0}}).switches, 0b1001u);
  EXPECT_EQ(limits.refused(), 0);
  EXPECT_EQ(limits.checked({0b0011, {3.0}}).switches, 0u);  // supply and exhaust of one chamber
  EXPECT_EQ(limits.checked({1u << 31, {3.0}}).switches, 0u);
  EXPECT_EQ(limits.refused(), 2);
  EXPECT_EQ(limits.checked({0, {std::numeric_limits<double>::quiet_NaN()}}).continuous[0], 0.0);
  EXPECT_EQ(limits.checked({0, {-std::numeric_limits<double>::infinity()}}).continuous[0], 0.0);
  EXPECT_EQ(limits.refused(), 4);
  EXPECT_EQ(limits.checked({0, {99.0}}).continuous[0], 8.0);
  EXPECT_EQ(limits.checked({0, {-99.0}}).continuous[0], -8.0);
}

/// Plant, controller and recorder in one, noting the order of its calls.
struct Journal final : Plant, Controller {
  std::vector<std::string> calls;
  std::vector<double> times_s;
  Measurement read(double time_s) noexcept override {
    calls.push_back("read");
    times_s.push_back(time_s);
    return {.time_s = time_s};
  }
  Decision step(const Measurement&) noexcept override {
    calls.push_back("step");
    Decision d;
    d.command = {0b0011, 99.0};
    return d;
  }
  void write(const Command& command) noexcept override {
    calls.push_back("write");
    written = command;
  }
  void record(const TickRecord& tick) noexcept {
    calls.push_back("record");
    last = tick;
  }
  Command written;
  TickRecord last;
};

TEST(ControlLoop, ReadsStepsChecksWritesRecordsOnceATick) {
  Journal journal;
  FakeClock clock;
  CommandLimits limits(valve_modes("two_way", {}), {8.0});
  ControlLoop loop(journal, clock, journal, limits, journal);
  loop.run(3, 0.001);
  const std::vector<std::string> tick = {"read", "step", "write", "record"};
  ASSERT_EQ(journal.calls.size(), 12u);
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(journal.calls[i], tick[i % 4]);
  EXPECT_THAT(journal.times_s, testing::ElementsAre(0.0, 0.001, 0.002));
  EXPECT_DOUBLE_EQ(clock.now_s(), 0.002);
  EXPECT_EQ(journal.written.switches, 0u);  // the limits stand between the controller and the plant
  EXPECT_EQ(journal.written.continuous[0], 8.0);
  EXPECT_EQ(journal.last.decision.command.switches, 0b0011u);
  EXPECT_EQ(journal.last.applied.continuous[0], 8.0);
}

}  // namespace
}  // namespace solenoid
