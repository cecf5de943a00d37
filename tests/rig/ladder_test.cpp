#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_guard.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/rig/fault_table.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"

#include <cctype>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// A slide that does as the reference says, and a controller whose plan is as old as a test wants it.
struct Bench {
  struct Primary final : Controller {
    explicit Primary(Bench& bench) : bench(bench) {}
    Decision step(const Measurement& s) noexcept override {
      Decision d;
      d.reference = bench.reference.at(s.time_s);
      const double y = s.value[position_channel];
      d.estimate = {std::isfinite(y) ? y : 0.05, 0.0, 150e3, 150e3};
      d.command = bench.wanted;
      d.plan_age = bench.plan_age;
      d.planned = bench.planned;
      d.rung = bench.plan_age < actuator_timing.ticks_per_period ? Rung::fresh : Rung::shifted;
      return d;
    }
    void applied(const Command& c) noexcept override { bench.told = c; }
    void restart(double time_s, const AxisValues& from) noexcept override {
      bench.reference.restart(time_s, from);
      ++bench.restarts;
    }
    Bench& bench;
  };

  explicit Bench(LadderSettings settings = actuator_ladder(), bool motor = true) {
    settings.plausibility.innovation_limit = 1e9;
    for (SensorBounds& channel : settings.plausibility.channels) {  // a bench without noise
      channel.stuck_ticks = 0;
      channel.stuck_change = 0;
    }
    auto guard = std::make_unique<ActuatorGuard>(
        PneumaticActuator(), modes, motor ? std::optional(MotorGains{}) : std::nullopt, actuator_timing.tick_s);
    ladder = std::make_unique<FallbackLadder>(FallbackLadder::Parts{std::make_unique<Primary>(*this),
                                                                    std::move(guard),
                                                                    modes,
                                                                    Trajectory(0.05),
                                                                    {position_channel},
                                                                    actuator_timing,
                                                                    settings});
  }
  Decision tick(int ticks = 1) {
    Decision d;
    for (int i = 0; i < ticks; ++i) {
      sensors.time_s = 1e-3 * k++;
      d = ladder->step(sensors);
      left = limits.checked(d.command);
      ladder->applied(left);
      EXPECT_GE(modes.find(left.switches), 0);
      EXPECT_LE(std::abs(left.continuous[0]), 8.0 + 1e-12);
    }
    return d;
  }

  ModeSet modes = valve_modes("two_way", {});
  RestartableReference reference{Trajectory(0.05)};
  CommandLimits limits{modes, {8.0}};
  Measurement sensors{.value = {0.05, 150e3, 150e3}};
  Command wanted{0b1001, {1.0}}, told, left;
  int plan_age = 0, k = 0, restarts = 0;
  bool planned = true;
  std::unique_ptr<FallbackLadder> ladder;
};

TEST(Ladder, StepsDownRungByRungAndClimbsBackAtOnce) {
  LadderSettings settings = actuator_ladder();
  settings.shifted_slots = 2;
  settings.held_slots = 3;
  settings.backup_slots = 4;
  Bench bench(settings);
  bench.tick(20);
  std::vector<Rung> seen;
  for (int slot = 1; slot <= 10; ++slot) {
    bench.plan_age = slot * actuator_timing.ticks_per_period;
    seen.push_back(bench.tick().rung);
    bench.tick(4);
  }
  const auto s = Rung::shifted, d = Rung::held, m = Rung::backup;
  EXPECT_THAT(seen, testing::ElementsAre(s, s, d, d, d, m, m, m, m, Rung::safe));

  Bench other(settings);
  other.tick(20);
  other.plan_age = 100;
  EXPECT_EQ(other.tick(5).rung, Rung::held);
  other.plan_age = 0;
  EXPECT_EQ(other.tick().rung, Rung::fresh);
  EXPECT_EQ(other.left, other.wanted);
}

TEST(Ladder, DmpcCommandsDriveBothChambersAndTheMotorRungHoldsTheCoilsOff) {
  Bench bench;
  bench.tick(20);
  bench.planned = false;
  bench.tick(3);
  const auto opening = bench.modes.point(bench.left.switches);
  EXPECT_EQ(opening[0] + opening[1], 1.0);
  EXPECT_EQ(opening[2] + opening[3], 1.0);
  bench.sensors.value[pressure_a_channel] = std::numeric_limits<double>::quiet_NaN();
  const Decision d = bench.tick(4);
  EXPECT_EQ(d.rung, Rung::backup);
  EXPECT_EQ(bench.left.switches, 0u);
  EXPECT_TRUE(d.faults.has(pressure_a_channel, SensorFault::not_finite));
}

TEST(Ladder, WithoutAMotorAFailedPressureEndsInSafe) {
  Bench bench(actuator_ladder(), false);
  bench.tick(20);
  bench.sensors.value[pressure_b_channel] = std::numeric_limits<double>::quiet_NaN();
  const Decision d = bench.tick(4);
  EXPECT_EQ(d.rung, Rung::safe);
  EXPECT_TRUE(d.safe_causes.has(pressure_b_channel, SensorFault::not_finite));
}

TEST(Ladder, IsRefusedWithoutBoundsForEveryChannel) {
  LadderSettings settings = actuator_ladder();
  settings.plausibility.channels.pop_back();
  const Campaign campaign = read_campaign("rig", {{"nine_state"}, {"cycloidal"}});
  const ScenarioConfig& scenario = campaign.scenarios.front();
  LadderSettings some = actuator_ladder();
  some.limits.pop_back();
  for (const LadderSettings& lacking : {settings, some, LadderSettings{}})
    EXPECT_THROW(make_ladder(campaign.variants.front(), scenario.trajectory, lacking), std::invalid_argument);
}

TEST(Ladder, LatchesSafeWithinASlotOfEachDanger) {
  const auto after = [](auto change, int ticks) {
    Bench bench;
    bench.tick(20);
    change(bench);
    const Decision d = bench.tick(ticks);
    EXPECT_EQ(bench.left.switches, 0u);
    EXPECT_EQ(bench.left.continuous[0], 0.0);
    EXPECT_EQ(bench.ladder->counts().safe_entries, 1);
    return d.safe_causes;
  };
  EXPECT_TRUE(after([](Bench& b) { b.sensors.value[position_channel] = NAN; }, 4)
                  .has(position_channel, SensorFault::not_finite));
  EXPECT_TRUE(
      after([](Bench& b) { b.sensors.value[position_channel] = 0.11; }, 4).has(position_channel, SensorFault::rail));
  EXPECT_TRUE(after([](Bench& b) { b.k += 21; }, 1).has(Fault::tick_gap));
  EXPECT_TRUE(after([](Bench& b) { b.sensors.node_was_safe = true; }, 1).has(Fault::node_safe));
  EXPECT_TRUE(after([](Bench& b) { b.ladder->request_stop(); }, 1).has(Fault::stopped));
  EXPECT_TRUE(after([](Bench& b) { b.wanted.continuous[0] = NAN; }, 2).has(Fault::command_refused));
  EXPECT_TRUE(after([](Bench& b) { b.wanted.switches = 0b0011; }, 2).has(Fault::command_refused));
  EXPECT_TRUE(after([](Bench& b) { b.sensors.stale_ticks = 11; }, 1).has(position_channel, SensorFault::stale));
  const auto moved = [](double to_m) {
    return [to_m](Bench& b) {
      while (std::abs(b.sensors.value[position_channel] - to_m) > 1e-9) {
        b.sensors.value[position_channel] += std::clamp(to_m - b.sensors.value[position_channel], -2e-3, 2e-3);
        b.tick();
      }
    };
  };
  EXPECT_TRUE(after(moved(0.1087), 1).has(Fault::axis_limit));
  EXPECT_TRUE(after(moved(-0.0055), 1).has(Fault::axis_limit));
}

TEST(Ladder, WhereThePlantGoesOnceStoppedIsSeenButIsNoCause) {
  FaultSet stopped;
  stopped.add(Fault::stopped);
  for (const bool first : {true, false}) {
    Bench bench;
    bench.tick(20);
    if (first) bench.ladder->request_stop();
    bench.tick();
    for (int step = 0; step < 6; ++step) {
      bench.sensors.value[pressure_b_channel] += 26e3;
      bench.tick();
    }
    Decision d = bench.tick();
    EXPECT_TRUE(d.faults.has(Fault::channel_limit));
    if (!first) bench.ladder->request_stop();
    d = bench.tick();
    EXPECT_EQ(d.rung, Rung::safe);
    EXPECT_EQ(d.safe_causes == stopped, first);
    EXPECT_EQ(d.safe_causes.has(Fault::channel_limit), !first);
  }
}

TEST(Ladder, InSafeSwitchesStandAsTheSystemSays) {
  VariantConfig variant = shipped_variant("inverter_n3");
  const System& system = system_of(variant);
  const Campaign campaign = read_campaign("inverter", {{"inverter_n3"}, {}});
  const auto ladder = make_ladder(variant, campaign.scenarios.front().trajectory, system.ladder(variant), nullptr);
  CommandLimits limits = make_limits(variant);
  const SwitchPattern zero = system.modes(variant).pattern(0);
  EXPECT_EQ(system.modes(variant).modes()[0].name, "000");
  Measurement sensors;
  const AxisValues start = campaign.scenarios.front().trajectory.start();
  EXPECT_EQ(limits.safe_command(), (Command{zero, {}}));
  int planned = 0;
  for (int k = 0; k < 40; ++k) {
    sensors.time_s = k * variant.timing.tick_s;
    for (std::size_t a = 0; a < 2; ++a) sensors.value[a] = start[a] + 1e-3 * (k % 2);
    if (k == 20) ladder->request_stop();
    const Decision d = ladder->step(sensors);
    const Command left = limits.checked(d.command);
    ladder->applied(left);
    EXPECT_EQ(d.rung == Rung::safe, k >= 20) << k;
    planned += k < 20 && left.switches != zero;
    EXPECT_TRUE(k < 20 || left == (Command{zero, {}})) << k;
  }
  EXPECT_GT(planned, 0);
  EXPECT_EQ(limits.refused(), 0);
}

TEST(Ladder, ReArmsOnlyByHandOnlyWhenSoundAndWithoutAJump) {
  Bench bench;
  bench.tick(20);
  bench.sensors.value[position_channel] = NAN;
  bench.tick(4);
  EXPECT_EQ(bench.tick(200).rung, Rung::safe);
  bench.ladder->request_rearm();
  EXPECT_EQ(bench.tick().rung, Rung::safe);
  EXPECT_EQ(bench.ladder->counts().refused_rearms, 1);
  bench.sensors.value[position_channel] = 0.03;  // it has moved, and reads again
  EXPECT_EQ(bench.tick(200).rung, Rung::safe);   // never by itself
  bench.ladder->request_rearm();
  EXPECT_EQ(bench.tick().rung, Rung::safe);  // its commands were decided before
  Decision d = bench.tick();
  EXPECT_EQ(d.rung, Rung::fresh);
  EXPECT_EQ(bench.restarts, 1);
  double before = 0.03;
  for (int i = 0; i < 1000; ++i) {
    d = bench.tick();
    ASSERT_LT(std::abs(d.reference.axis[0].value - before), 1e-3 * 0.11);  // twice the mean speed of the approach
    before = d.reference.axis[0].value;
  }
  EXPECT_NEAR(before, 0.05, 1e-6);
}

/// The whole chain around the twin, nothing wrong with it.
struct Quiet {
  void record(const TickRecord& t) noexcept {
    degraded += t.decision.rung != Rung::fresh;
    if (t.decision.rung == Rung::safe) causes |= t.decision.safe_causes;
    seen |= t.decision.faults;
  }
  int degraded = 0;
  FaultSet causes, seen;
};

TEST(Ladder, KeepsCountOfTimeThroughSkippedTicks) {
  const Campaign campaign = read_campaign("rig", {{"nine_state"}, {"cycloidal"}});
  const ScenarioConfig& scenario = campaign.scenarios.front();
  const VariantConfig& variant = campaign.variants.front();
  struct Stumbling final : Plant {
    Measurement read(double time_s) noexcept override {
      if (++reads % 200 == 0) clock.sleep_until(clock.now_s() + 6.2e-3);  // the machine stands still
      return plant->read(time_s);
    }
    void write(const Command& command) noexcept override { plant->write(command); }
    explicit Stumbling(FakeClock& c) : clock(c) {}
    FakeClock& clock;
    std::unique_ptr<SimulatedPlant> plant;
    int reads = 0;
  };
  FakeClock clock;
  Stumbling plant(clock);
  plant.plant = make_plant(variant, scenario, 5);
  const auto ladder = make_ladder(variant, scenario.trajectory, actuator_ladder(), nullptr);
  CommandLimits limits = make_limits(variant);
  Quiet quiet;
  ControlLoop loop(plant, clock, *ladder, limits, quiet);
  loop.run(8000, actuator_timing.tick_s);
  EXPECT_GT(loop.counts().skipped, 150);
  EXPECT_EQ(quiet.degraded, 0) << to_string(quiet.causes, actuator_description()) << "; seen "
                               << to_string(quiet.seen, actuator_description());
}

TEST(Ladder, RefusesAReArmWhileTheSlideMoves) {
  Bench bench;
  bench.tick(20);
  bench.sensors.node_was_safe = true;
  bench.tick();
  bench.sensors.node_was_safe = false;
  const auto slide = [&](double speed_m_s, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      bench.sensors.value[position_channel] += 1e-3 * speed_m_s;
      bench.tick();
    }
  };
  slide(0.1, 200);
  bench.ladder->request_rearm();
  slide(0.1, 2);
  EXPECT_EQ(bench.ladder->counts().refused_rearms, 1);
  EXPECT_EQ(bench.tick().rung, Rung::safe);
  slide(0.0, 200);
  bench.ladder->request_rearm();
  bench.tick();
  EXPECT_EQ(bench.tick().rung, Rung::fresh);
  EXPECT_EQ(bench.ladder->counts().rearms, 1);
}

TEST(Ladder, AStopIsForGood) {
  Bench bench;
  bench.tick(20);
  bench.ladder->request_stop();
  bench.tick(100);
  bench.ladder->request_rearm();
  EXPECT_EQ(bench.tick(10).rung, Rung::safe);
}

TEST(Ladder, LowersForABoundedTimeIfTold) {
  LadderSettings settings = actuator_ladder();
  settings.lowering_s = 0.1;
  Bench bench(settings);
  for (int i = 0; i < 100; ++i) {  // a slide that falls at 0.1 m/s
    bench.sensors.value[position_channel] -= 1e-4;
    bench.tick();
  }
  bench.ladder->request_stop();
  double braking = 0.0;
  for (int i = 0; i < 90; ++i) {
    bench.sensors.value[position_channel] -= 1e-4;
    bench.tick();
    EXPECT_EQ(bench.left.switches, 0u);
    braking = std::max(braking, bench.left.continuous[0]);
  }
  EXPECT_GT(braking, 2.0);  // against the motion
  bench.tick(20);
  EXPECT_EQ(bench.left.continuous[0], 0.0);
}

TEST(Ladder, FindsNoFaultInASoundPlantWhateverItsPayloadFrictionAndFlow) {
  struct World {
    double payload_kg, friction, flow;
  };
  for (const World w :
       {World{0, 1, 1}, {0.15, 1, 1}, {0.46, 1, 1}, {0.15, 1.5, 0.9}, {0, 0.7, 1.1}, {0.15, 2.0, 0.8}}) {
    const Campaign campaign = read_campaign("rig", {{"nine_state"}, {"cycloidal"}});
    ScenarioConfig scenario = campaign.scenarios.front();
    actuator(scenario).payload_kg = w.payload_kg;
    actuator(scenario).mismatch.friction = w.friction;
    actuator(scenario).mismatch.flow = w.flow;
    const VariantConfig& variant = campaign.variants.front();
    const auto plant = make_plant(variant, scenario, 5);
    const auto ladder = make_ladder(variant, scenario.trajectory, actuator_ladder(), nullptr);
    CommandLimits limits = make_limits(variant);
    FakeClock clock;
    Quiet quiet;
    ControlLoop loop(*plant, clock, *ladder, limits, quiet);
    loop.run(20'000, actuator_timing.tick_s);  // the motion, then holding for twelve seconds
    EXPECT_EQ(quiet.degraded, 0) << w.payload_kg << " " << w.friction << " " << w.flow << ": "
                                 << to_string(quiet.causes, actuator_description()) << "; seen "
                                 << to_string(quiet.seen, actuator_description());
  }
}

TEST(FaultTable, EveryFaultEndsWhereItShouldAndNothingOutOfRangeLeaves) {
  for (const FaultOutcome& f : simulated_faults("nine_state")) {
    SCOPED_TRACE(f.fault);
    EXPECT_TRUE(f.in_range);
    if (f.fault.starts_with("solver:throw")) {
      EXPECT_THAT(f.note, testing::HasSubstr("before the first command"));
      continue;
    }
    const bool solver = f.fault.starts_with("solver");
    if (!solver) {  // no fault of sensor, valves or supply goes unanswered
      EXPECT_GE(f.worst, Rung::backup);
    }
    if (f.fault.starts_with("position") && f.note != "re-armed") {
      EXPECT_EQ(f.last, Rung::safe);
      EXPECT_EQ(f.final_command.switches, 0u);
      EXPECT_EQ(f.final_command.continuous[0], 0.0);
    }
    // What a single value shows is answered within one slot of its first sight.
    if (f.fault.find("garbage") != std::string::npos || f.fault.starts_with("position:off")) {
      EXPECT_LE(f.acted_ms, 5.0);
    }
    if (f.fault.starts_with("solver:late")) {
      EXPECT_LE(f.worst, Rung::held);
      EXPECT_EQ(f.last, Rung::fresh);
    }
    if (f.fault.starts_with("solver:late=1@") || f.fault.starts_with("solver:late=2@")) {
      EXPECT_EQ(f.worst, Rung::fresh);
    }
    if (f.fault.starts_with("solver:hang") || f.fault.starts_with("solver:nan")) {
      EXPECT_TRUE(f.causes.has(Fault::no_plan));
      EXPECT_LE(f.detected_ms, 10.0);
    }
    if (f.note == "re-armed") {
      EXPECT_EQ(f.last, Rung::fresh);
    }
  }
}

// Each coil stuck, at rest and moving: noticed, named where it shows itself, and no command out of range; where it is named, plans go
// on without it.
TEST(FaultTable, CoilsThatAreStuckAreNamedAndDoneWithout) {
  const auto coil_of = [](const std::string& text) {  // "supply A stuck on" and "coil_supply_a:stuck_open@1" alike
    std::string name = text.starts_with("coil_") ? text.substr(5) : text;
    for (char& c : name) c = c == ' ' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return name.substr(0, name.find("_stuck")).substr(0, name.find(':'));
  };
  int named = 0, rows = 0;
  for (const FaultOutcome& f : coil_faults("nine_state")) {
    SCOPED_TRACE(f.fault + " " + f.note);
    ++rows;
    EXPECT_TRUE(f.in_range);
    EXPECT_GE(f.detected_ms, 0.0);
    if (coil_of(f.note) != coil_of(f.fault)) continue;
    ++named;
    EXPECT_EQ(f.worst, Rung::fresh);
  }
  EXPECT_EQ(rows, 16);
  EXPECT_GE(named, 14);
}

}  // namespace
}  // namespace solenoid
