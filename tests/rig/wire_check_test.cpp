#include "experiments/rig/wire_check.hpp"

#include <cmath>
#include <map>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// A wire of these times; of a thousand requests some have no answer.
WireHealth wire_of(double p99_us, double least_us, std::int64_t lost = 0, double drift_ppm = 20.0) {
  WireHealth wire;
  wire.round_trip_us = {.p50 = (p99_us + least_us) / 2, .p99 = p99_us, .max = 2 * p99_us};
  wire.least_round_trip_us = least_us;
  wire.answered = 1000 - lost;
  wire.lost = lost;
  wire.drift_ppm = drift_ppm;
  return wire;
}

/// Results by name, the verdict's words among them.
std::map<std::string, std::string> wire_results(const WireHealth& wire) {
  std::map<std::string, std::string> results;
  for (const WireFinding& found : wire_checks(wire, 1e-3)) {
    results[found.name] = found.good ? "ok" : "failed";
    if (found.name == "1000 Hz") results["words"] = found.detail;
  }
  return results;
}

TEST(WireCheck, SaysWhetherAWireDoesAndWhy) {
  using testing::StartsWith;
  auto good = wire_results(wire_of(90, 50));
  for (const char* name : {"round trip", "jitter", "loss", "clock", "1000 Hz"}) EXPECT_EQ(good[name], "ok") << name;
  EXPECT_THAT(good["words"], StartsWith("yes: samples are of the tick that asks"));

  auto late = wire_results(wire_of(4000, 100, 190));
  EXPECT_EQ(late["1000 Hz"], "ok");
  EXPECT_THAT(late["words"], StartsWith("yes: samples are late"));

  auto delayed = wire_results(wire_of(20'100, 20'000));  // steady, and nothing a loop can do with
  EXPECT_EQ(delayed["round trip"], "failed");
  EXPECT_THAT(delayed["words"], StartsWith("no: the quickest round trip takes more than 5 ticks"));

  WireHealth old = wire_of(90, 50);
  old.age_us.p99 = 5001;
  EXPECT_EQ(wire_results(old)["age"], "failed");
  EXPECT_EQ(wire_results(old)["1000 Hz"], "failed");
  WireHealth empty = wire_of(90, 50);
  empty.reads = 1000;
  empty.missed = 500;
  EXPECT_THAT(wire_results(empty)["words"], StartsWith("no: too many reads have no sample"));

  WireHealth jumping = wire_of(90, 50);
  jumping.clock_jumps = 1;
  EXPECT_EQ(wire_results(jumping)["clock"], "failed");
  EXPECT_EQ(wire_results(jumping)["1000 Hz"], "failed");

  auto unsteady = wire_results(wire_of(4300, 100));
  EXPECT_EQ(unsteady["round trip"], "failed");
  EXPECT_EQ(unsteady["jitter"], "failed");
  EXPECT_EQ(unsteady["1000 Hz"], "failed");

  auto lossy = wire_results(wire_of(90, 50, 254));
  EXPECT_EQ(lossy["loss"], "failed");
  EXPECT_THAT(lossy["words"], StartsWith("no: 25.3 %"));
  EXPECT_EQ(wire_results(wire_of(90, 50, 249))["loss"], "ok");

  auto drifting = wire_results(wire_of(90, 50, 0, -101.0));
  EXPECT_EQ(drifting["clock"], "failed");
  EXPECT_EQ(drifting["1000 Hz"], "failed");

  auto silent = wire_results(wire_of(0, 0, 1000));
  EXPECT_EQ(silent["round trip"], "failed");
  EXPECT_EQ(silent["loss"], "failed");
  EXPECT_THAT(silent["words"], StartsWith("no: nothing was answered"));
}

/// A loss at the limit is one run in SAFE an hour, by the formula, at ticks where samples and where commands decide.
TEST(WireCheck, LimitsFollowTheTick) {
  const WireLimits fast = wire_limits(1e-3), slow = wire_limits(1e-2);
  EXPECT_NEAR(std::pow(fast.loss, 11) * 3.6e6, 1.0, 1e-9);
  EXPECT_NEAR(slow.loss * 3.6e5, 1.0, 1e-9);  // one lost command is 20 ms of silence
  EXPECT_DOUBLE_EQ(fast.wait_s, 400e-6);
  EXPECT_DOUBLE_EQ(fast.age_s, 5e-3);
  EXPECT_DOUBLE_EQ(slow.wait_s, 4e-3);
  EXPECT_DOUBLE_EQ(slow.age_s, 40e-3);
}

TEST(WireHealth, JitterIsOfOneDirectionAndLossOfAllRequests) {
  const WireHealth wire = wire_of(4100, 100, 50);
  EXPECT_DOUBLE_EQ(wire.jitter_us(), 2000);
  EXPECT_DOUBLE_EQ(wire.loss(), 0.05);
  EXPECT_EQ(WireHealth().loss(), 0.0);
  EXPECT_THAT(wire.text(), testing::HasSubstr("jitter 2000 us; 5.00 % lost"));
}

}  // namespace
}  // namespace solenoid
