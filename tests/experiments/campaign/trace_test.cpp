#include "experiments/campaign/trace.hpp"

#include "core/systems/actuator/valves.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulate.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

ScenarioConfig noisy_sine(double duration_s) {
  ScenarioConfig s;
  s.name = "sine";
  s.trajectory = thesis_sine(0.0197);
  s.noise = true;
  s.ideal_sensing = false;
  s.duration_s = duration_s;
  return s;
}

const RunResult& simulated() {
  static const RunResult run = simulate(shipped_variant("nine_pd"), noisy_sine(1.0), 1);
  return run;
}

Trace simulated_trace() { return make_trace(shipped_variant("nine_pd"), noisy_sine(1.0), simulated().ticks); }

/// Random walks over ticks with gaps, as a rig that skips has them.
Trace random_trace(std::size_t samples, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> step;
  Trace trace;
  trace.modes = {"hold", "fill"};
  trace.cylinder_force = {-10.0, 4.5e-4, -4.2e-4};
  std::int64_t tick = 0;
  for (std::size_t i = 0; i < samples; ++i) trace.ticks.push_back(tick += 1 + (random() % 20 == 0 ? random() % 7 : 0));
  for (const auto& [name, resolution] : {std::pair{"reference", 1e-7},
                                         {"position", 1e-7},
                                         {"pressure_a", 10.0},
                                         {"pressure_b", 10.0},
                                         {"mode", 1.0},
                                         {"motor", 1e-3}}) {
    Trace::Signal signal{name, "", resolution, {}};
    double value = 0.0;
    for (std::size_t i = 0; i < samples; ++i) signal.values.push_back(value += 30 * resolution * step(random));
    trace.signals.push_back(std::move(signal));
  }
  return trace;
}

TEST(Trace, KeepsEveryTickToItsResolution) {
  const Trace before = simulated_trace(), after = decode_trace(encode_trace(before));
  EXPECT_EQ(after.ticks, before.ticks);
  EXPECT_EQ(after.modes, before.modes);
  EXPECT_EQ(after.cylinder_force, before.cylinder_force);
  EXPECT_EQ(after.motor_limit_n, before.motor_limit_n);
  EXPECT_EQ(after.solves.counts, before.solves.counts);
  EXPECT_FALSE(after.measured);
  ASSERT_EQ(after.signals.size(), before.signals.size());
  for (const Trace::Signal& signal : before.signals) {
    const std::vector<double>& values = after.signal(signal.name).values;
    ASSERT_EQ(values.size(), signal.values.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      ASSERT_NEAR(values[i], signal.values[i], 0.5000001 * signal.resolution) << signal.name << " " << i;
  }
}

TEST(Trace, IsSmall) {
  const std::string bytes = encode_trace(simulated_trace());
  EXPECT_LT(bytes.size(), 4 * simulated().ticks.size());  // of 48 bytes a tick as doubles
}

TEST(Trace, DrawsTheSameErrorsAsTheRunHad) {
  const VariantConfig variant = shipped_variant("nine_pd");
  const Trace trace = decode_trace(encode_trace(simulated_trace()));
  const std::vector<TickRecord> ticks = ticks_of(trace, valve_modes(variant.valves, variant.nominal));
  double squares = 0.0;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const double error = 1e3 * (ticks[i].decision.reference.axis[0].value - ticks[i].sensors.truth[position]);
    squares += error * error;
    ASSERT_EQ(ticks[i].applied.switches, simulated().ticks[i].applied.switches);
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(ticks.size())), simulated().metrics["rmse_mm"], 1e-4);
}

TEST(Trace, CylinderForceIsThePlantsOwn) {
  ScenarioConfig scenario = noisy_sine(1.0);
  scenario.mismatch.supply = 0.9;
  const VariantConfig variant = shipped_variant("nine_pd");
  const PneumaticActuator plant(scenario.mismatch.applied_to(variant.nominal));
  const auto c = make_trace(variant, scenario, simulated().ticks).cylinder_force;
  for (const double a : {1.0e5, 2.1e5})
    for (const double b : {1.0e5, 2.5e5}) EXPECT_NEAR(c[0] + c[1] * a + c[2] * b, plant.cylinder_force(a, b), 1e-6);
}

TEST(Trace, WhatIsNoNumberStaysNone) {
  Trace trace = random_trace(50, 1);
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  auto& values = trace.signals[1].values;
  values[7] = nan;
  values[20] = infinity;
  values[21] = -1e300;
  std::fill(values.begin() + 40, values.end(), nan);
  const Trace after = decode_trace(encode_trace(trace));
  const auto& read = after.signals[1].values;
  EXPECT_TRUE(std::isnan(read[7]));
  EXPECT_GT(read[20], 1e6);
  EXPECT_LT(read[21], -1e6);
  EXPECT_NEAR(read[8], values[8], 0.51e-7);
  EXPECT_NEAR(read[22], values[22], 0.51e-7);
  for (std::size_t i = 40; i < 50; ++i) EXPECT_TRUE(std::isnan(read[i]));
}

TEST(Trace, DamagedBytesAreRefused) {
  const std::string bytes = encode_trace(random_trace(300, 2));
  for (std::size_t size = 0; size < bytes.size(); size += 7)
    EXPECT_THROW(decode_trace(std::string_view(bytes).substr(0, size)), std::invalid_argument) << size;
  EXPECT_THROW(decode_trace("variant,scenario\n"), std::invalid_argument);
}

TEST(Trace, TheReportsPageReadsTheSameNumbers) {
  if (std::system("command -v node >/dev/null 2>&1") != 0) GTEST_SKIP() << "needs: apt-get install nodejs";
  Trace trace = random_trace(3000, 6);
  auto& positions = trace.signals[1].values;
  positions[1234] = 0.5;  // peaks of one sample
  positions[2345] = -0.5;
  std::fill(positions.begin() + 2900, positions.end(), std::numeric_limits<double>::quiet_NaN());
  const test::Folder folder;
  folder.write("run.trace", encode_trace(trace));
  nlohmann::json numbers = {{"tick", trace.ticks}};
  for (const Trace::Signal& signal : trace.signals) numbers[signal.name] = signal.values;  // NaN becomes null
  folder.write("numbers.json", numbers.dump());
  const std::string command = "cd '" + folder.path() +
                              "' && node '" SOLENOID_SOURCE_DIR
                              "/tests/experiments/campaign/trace_reader.mjs' '" SOLENOID_SOURCE_DIR
                              "/experiments/report/assets/trace.js' run.trace numbers.json >out 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(test::text_of(folder / "out"), "same\n");
}

TEST(TraceOverview, LosesNoPeak) {
  constexpr int spans = 37;
  for (const std::size_t samples : {75u, 1000u, 4321u}) {
    const Trace trace = random_trace(samples, 3), reduced = overview(trace, spans);
    ASSERT_EQ(reduced.ticks.size(), 2u * spans);
    const std::int64_t from = trace.ticks.front(), length = trace.ticks.back() + 1 - from;
    const auto value = [&](const std::string& name, std::size_t i) {
      if (name == "error") return trace.signal("reference").values[i] - trace.signal("position").values[i];
      if (name == "cylinder")
        return trace.cylinder_force[0] + trace.cylinder_force[1] * trace.signal("pressure_a").values[i] +
               trace.cylinder_force[2] * trace.signal("pressure_b").values[i];
      return trace.signal(name).values[i];
    };
    for (const Trace::Signal& signal : reduced.signals) {
      for (std::size_t s = 0; s < spans; ++s) {
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (std::size_t i = 0; i < samples; ++i) {
          if ((trace.ticks[i] - from) < length * static_cast<std::int64_t>(s) / spans) continue;
          if ((trace.ticks[i] - from) >= length * static_cast<std::int64_t>(s + 1) / spans) break;
          low = std::min(low, value(signal.name, i));
          high = std::max(high, value(signal.name, i));
        }
        const double a = signal.values[2 * s], b = signal.values[2 * s + 1];
        if (low > high) {
          EXPECT_TRUE(std::isnan(a) && std::isnan(b));  // a gap longer than the span
          continue;
        }
        EXPECT_EQ(std::min(a, b), low) << signal.name << " span " << s;
        EXPECT_EQ(std::max(a, b), high) << signal.name << " span " << s;
      }
    }
  }
}

TEST(TraceOverview, TimesIncreaseInsideTheRun) {
  const Trace trace = random_trace(5000, 4), reduced = overview(trace, 100);
  EXPECT_TRUE(std::ranges::is_sorted(reduced.ticks));
  EXPECT_GE(reduced.ticks.front(), trace.ticks.front());
  EXPECT_LE(reduced.ticks.back(), trace.ticks.back());
}

TEST(TraceOverview, AShortRunKeepsEachTick) {
  const Trace trace = random_trace(60, 5), reduced = overview(trace, 40);
  EXPECT_EQ(reduced.ticks, trace.ticks);
  EXPECT_EQ(reduced.signal("position").values, trace.signal("position").values);
}

TEST(SolveHistogram, CountsInTenthsOfADecade) {
  SolveHistogram histogram;
  for (const double us : {1.0, 1.2, 1.3, 9.9, 10.0, 5000.0, 4999.0}) histogram.add(us);
  EXPECT_EQ(histogram.first, 0);
  const auto count = [&](int bin) { return histogram.counts[static_cast<std::size_t>(bin - histogram.first)]; };
  EXPECT_EQ(count(0), 2);   // 1.00 to 1.26
  EXPECT_EQ(count(1), 1);   // 1.26 to 1.58
  EXPECT_EQ(count(9), 1);   // 7.94 to 10
  EXPECT_EQ(count(10), 1);  // 10 to 12.6
  EXPECT_EQ(count(36), 2);  // 3981 to 5012
  EXPECT_EQ(histogram.total(), 7);
}

TEST(SolveHistogram, TakesAnyOrderAndAnyTime) {
  SolveHistogram histogram, other;
  for (const double us : {300.0, 2.0, 0.0, 1e12}) histogram.add(us);
  EXPECT_EQ(histogram.first, SolveHistogram::least);
  EXPECT_EQ(histogram.first + static_cast<int>(histogram.counts.size()) - 1, SolveHistogram::most);
  other.add(300.0);
  other.add(histogram);
  EXPECT_EQ(other.total(), 5);
  EXPECT_EQ(other.counts[static_cast<std::size_t>(24 - other.first)], 2);
}

}  // namespace
}  // namespace solenoid
