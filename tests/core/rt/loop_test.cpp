#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "core/rt/mailbox.hpp"
#include "core/rt/process_setup.hpp"
#include "core/rt/ring.hpp"
#include "core/systems/actuator/valves.hpp"

#include <map>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// A plant that takes as long as it is told, on a clock that it moves; and the controller and recorder beside it.
struct SlowWorld final : Plant, Controller {
  explicit SlowWorld(FakeClock& shared) : clock(shared) {}
  Measurement read(double time_s) noexcept override {
    spend(reading_s, time_s);
    return {.time_s = time_s};
  }
  Decision step(const Measurement& sensors) noexcept override {
    spend(deciding_s, sensors.time_s);
    Decision d;
    d.command = {0b1001, {3.0}};
    return d;
  }
  void applied(const Command& command) noexcept override { told.push_back(command); }
  void write(const Command& command) noexcept override { written.push_back(command); }
  void record(const TickRecord& tick) noexcept { ticks.push_back(tick); }
  void spend(const std::map<int, double>& times, double time_s) {
    const auto at = times.find(static_cast<int>(std::lround(time_s / 1e-3)));
    if (at != times.end()) clock.sleep_until(clock.now_s() + at->second);
  }
  std::vector<int> indices() const {
    std::vector<int> list;
    for (const TickRecord& t : ticks) list.push_back(static_cast<int>(std::lround(t.sensors.time_s / 1e-3)));
    return list;
  }

  FakeClock& clock;
  std::map<int, double> reading_s, deciding_s;  // by tick
  std::vector<Command> written, told;
  std::vector<TickRecord> ticks;
};

struct LoopTest : testing::Test {
  FakeClock clock;
  SlowWorld world{clock};
  CommandLimits limits{valve_modes("two_way", {}), {2.0}};
  ControlLoop<FakeClock, SlowWorld> loop{world, clock, world, limits, world};
};

TEST_F(LoopTest, SkipsTicksWhoseTimeHasPassedCountsThemAndKeepsThePhase) {
  world.reading_s[2] = 3.4e-3;  // over at 5.4 ms: ticks 3 and 4 are gone, 5 is late
  world.deciding_s[8] = 0.9e-3;
  loop.run(12, 1e-3);
  EXPECT_THAT(world.indices(), testing::ElementsAre(0, 1, 2, 5, 6, 7, 8, 9, 10, 11));
  EXPECT_EQ(loop.counts().ticks, 10);
  EXPECT_EQ(loop.counts().skipped, 2);
  EXPECT_EQ(loop.counts().late, 1);
  EXPECT_EQ(world.ticks[3].skipped, 2);
  EXPECT_NEAR(world.ticks[2].timing.read_us, 3400, 0.1);
  EXPECT_NEAR(world.ticks[3].timing.late_us, 400, 0.1);
  EXPECT_NEAR(world.ticks[6].timing.control_us, 900, 0.1);
  EXPECT_NEAR(clock.now_s(), 11e-3, 1e-12);  // the last tick was due where it always was
}

TEST_F(LoopTest, CountsWhatWasStillDueWhenTheTimeIsOver) {
  world.deciding_s[4] = 1.0;
  loop.run(10, 1e-3);
  EXPECT_EQ(loop.counts().ticks, 5);
  EXPECT_EQ(loop.counts().skipped, 5);
  EXPECT_EQ(loop.counts().ticks + loop.counts().skipped, 10);
}

TEST_F(LoopTest, EndsWhenToldAndTellsTheControllerWhatLeft) {
  int ticks = 0;
  loop.run(1000, 1e-3, [&] { return ++ticks == 3; });
  EXPECT_EQ(loop.counts().ticks, 3);
  ASSERT_EQ(world.told.size(), 3u);
  EXPECT_EQ(world.told[0].continuous[0], 2.0);  // 3 N wanted, 2 N allowed
  EXPECT_EQ(world.told, world.written);
}

TEST(CommandLimits, RatesSlowTheWayOutButNeverTheWayBack) {
  CommandLimits limits(valve_modes("two_way", {}), {8.0});
  limits.set_rates({.continuous_per_tick = 3.0, .switch_period_ticks = 5});
  EXPECT_EQ(limits.checked({0, {8.0}}).continuous[0], 3.0);
  EXPECT_EQ(limits.checked({0, {8.0}}).continuous[0], 6.0);
  EXPECT_EQ(limits.checked({0, {0.0}}).continuous[0], 0.0);  // to rest at once
  EXPECT_EQ(limits.checked({0, {8.0}}).continuous[0], 3.0);
  EXPECT_EQ(limits.checked({0, {-8.0}}).continuous[0], 0.0);  // across zero at the rate
  EXPECT_EQ(limits.slowed(), 4);
  EXPECT_EQ(limits.checked({0b0001, {0}}).switches, 0b0001u);
  EXPECT_EQ(limits.checked({0b0000, {0}}).switches, 0b0000u);  // off at once
  EXPECT_EQ(limits.checked({0b0001, {0}}).switches, 0b0000u);  // on again only five ticks after the last time
  EXPECT_EQ(limits.checked({0b0101, {0}}).switches, 0b0100u);  // another coil is free
  EXPECT_EQ(limits.checked({0b0101, {0}}).switches, 0b0100u);
  EXPECT_EQ(limits.checked({0b0101, {0}}).switches, 0b0101u);
  EXPECT_EQ(limits.refused(), 0);
}

TEST(CommandLimits, WhatIsRefusedBecomesTheSafePatternWhichNoRateHoldsBack) {
  const ModeSet modes("three", {{"a"}, {"b"}}, {{"0", 0b01}, {"+", 0b11}, {"-", 0b00}}, {0}, {{1}, {1}}, {}, 0b01);
  CommandLimits limits(modes, {});
  limits.set_rates({.switch_period_ticks = 5});
  EXPECT_EQ(limits.safe_command(), (Command{0b01, {}}));
  EXPECT_EQ(limits.checked({0b11, {}}).switches, 0b11u);
  EXPECT_EQ(limits.checked({0b10, {}}).switches, 0b01u);  // no pattern of the set
  EXPECT_EQ(limits.refused(), 1);
  EXPECT_EQ(limits.checked({0b00, {}}).switches, 0b00u);
  EXPECT_EQ(limits.checked({0b00, {}}).switches, 0b00u);
  EXPECT_EQ(limits.checked({0b11, {}}).switches, 0b01u);  // b was on a moment ago
  EXPECT_EQ(limits.checked({0b00, {}}).switches, 0b00u);
  EXPECT_EQ(limits.checked({0b01, {}}).switches, 0b01u);  // a was on a moment ago, but this is safe
}

TEST(MemoryRecorder, KeepsTheFirstTicksAndCountsTheRest) {
  MemoryRecorder recorder(2);
  TickRecord tick;
  for (int k = 0; k < 3; ++k) {
    tick.sensors.time_s = 0.001 * k;
    recorder.record(tick);
  }
  ASSERT_EQ(recorder.records().size(), 2u);
  EXPECT_EQ(recorder.records().back().sensors.time_s, 0.001);
  EXPECT_EQ(recorder.dropped(), 1u);
}

TEST(Mailbox, GivesTheNewestWholeAndOnlyOnce) {
  Mailbox<std::array<int, 2>> box;
  EXPECT_FALSE(box.take());
  for (int i = 1; i <= 3; ++i) {
    box.back() = {i, -i};
    box.put();
  }
  ASSERT_TRUE(box.take());
  EXPECT_EQ(box.front()[0], 3);
  EXPECT_FALSE(box.take());
  EXPECT_EQ(box.front()[0], 3);
}

TEST(Mailbox, NeverTearsAValueOrGoesBackBetweenThreads) {
  struct Wide {
    std::array<std::int64_t, 64> copies{};
  };
  Mailbox<Wide> box;
  constexpr std::int64_t last = 200'000;
  std::thread writer([&] {
    for (std::int64_t i = 1; i <= last; ++i) {
      box.back().copies.fill(i);
      box.put();
    }
  });
  std::int64_t seen = 0;
  bool whole = true, forwards = true;
  while (seen < last) {
    if (!box.take()) continue;
    const Wide& value = box.front();
    for (const std::int64_t copy : value.copies) whole = whole && copy == value.copies[0];
    forwards = forwards && value.copies[0] > seen;
    seen = value.copies[0];
  }
  writer.join();
  EXPECT_TRUE(whole);
  EXPECT_TRUE(forwards);
}

TEST(Ring, KeepsOrderAndRefusesWhenFull) {
  Ring<int> ring(3);
  int value = 0;
  EXPECT_FALSE(ring.pop(value));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(ring.push(i));
  EXPECT_FALSE(ring.push(9));
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(ring.pop(value));
    EXPECT_EQ(value, i);
  }
  EXPECT_TRUE(ring.push(4));
}

TEST(Ring, LosesNothingBetweenThreads) {
  Ring<std::int64_t> ring(64);
  constexpr std::int64_t count = 300'000;
  std::thread writer([&] {
    for (std::int64_t i = 0; i < count;) i += ring.push(i) ? 1 : 0;
  });
  bool in_order = true;
  for (std::int64_t i = 0, value = 0; i < count;)
    if (ring.pop(value)) in_order = in_order && value == i++;
  writer.join();
  EXPECT_TRUE(in_order);
}

TEST(MonotonicClock, SleepsToAMomentNeverShortOfIt) {
  MonotonicClock clock;
  double before = clock.now_s();
  for (int i = 1; i <= 20; ++i) {
    const double until = before + 5e-4 * i;
    clock.sleep_until(until);
    EXPECT_GE(clock.now_s(), until - 1e-9);
  }
  before = clock.now_s();
  clock.sleep_until(before - 1.0);  // a moment that is over is no sleep
  EXPECT_GE(clock.now_s(), before);
}

TEST(ProcessSetup, SaysWhatWasGrantedOrWhatWouldPermitIt) {
  for (const SetupStep& step : {set_fifo_priority("test", 1), lock_memory(1 << 20)}) {
    EXPECT_FALSE(step.detail.empty());
    if (!step.granted) {
      EXPECT_THAT(step.detail, testing::HasSubstr("/etc/security/limits.d"));
    }
  }
  set_fifo_priority("test", 0);
  const SetupStep nowhere = pin_to_core("test", 1023);
  EXPECT_FALSE(nowhere.granted);
  ASSERT_FALSE(usable_cores().empty());
}

}  // namespace
}  // namespace solenoid
