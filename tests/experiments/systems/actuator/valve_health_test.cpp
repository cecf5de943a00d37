#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_guard.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/document.hpp"
#include "experiments/base/embedded.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/systems/actuator/health/health_run.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

Campaign health_campaign() {
  return read_campaign(
      Document::from_text(std::string(embedded_text("tasks/valve_health.toml")), "tasks/valve_health.toml"));
}

constexpr SwitchFault stuck_open{SwitchFaultKind::stuck_on}, stuck_closed{SwitchFaultKind::stuck_off};

// Some of the rows of `study valve-health`, on plants with hidden mismatches: the right coil, in time, whichever it is.
TEST(ValveHealthOnTheTwin, FindsStuckCoilsInTime) {
  const Campaign campaign = health_campaign();
  int shown = 0, in_time = 0;
  for (std::size_t v = 0; v < campaign.variants.size(); ++v) {
    const std::size_t coils = v == 0 ? 4 : 8;
    for (std::size_t coil = 0; coil < coils; ++coil)
      for (const SwitchFault& fault : {stuck_open, stuck_closed}) {
        ScenarioConfig scenario = campaign.scenarios.at(200 + 3 * coil);  // moving
        scenario.duration_s = 3.0;
        const HealthRun run =
            run_with_fault(campaign.variants[v], scenario, coil + 1, CoilFault{coil, fault, 1.5}, 0.0);
        if (!run.shown_s && !run.found) continue;
        ++shown;  // or was called before it had
        in_time += run.found && run.found->c == coil && run.found->fault.kind == fault.kind &&
                   (!run.shown_s || *run.found_s - *run.shown_s <= 0.15);
      }
  }
  EXPECT_GE(shown, 20);
  EXPECT_GE(in_time, 95 * shown / 100);
}

TEST(ValveHealthOnTheTwin, CallsNoSoundCoilFailed) {
  const Campaign campaign = health_campaign();
  for (std::size_t v = 0; v < campaign.variants.size(); ++v)
    for (std::size_t member = 0; member < 200; member += 40)
      for (const std::size_t first : {0u, 200u}) {
        const HealthRun run =
            run_with_fault(campaign.variants[v], campaign.scenarios.at(first + member), member + 1, {}, 0.0);
        EXPECT_FALSE(run.found) << campaign.variants[v].name << " " << first + member;
      }
}

/// The ladder around a variant on the twin of a member, a coil of which fails at a moment.
struct Bench {
  explicit Bench(std::size_t variant_index)
      : campaign(health_campaign()),
        scenario(campaign.scenarios.at(205)),
        variant(told(campaign.variants[variant_index], scenario)),
        plant(make_plant(variant, scenario, 3)),
        ladder(make_ladder(variant, scenario.trajectory, actuator_ladder())),
        limits(make_limits(variant)) {}

  Decision tick() {
    const Measurement sensors = plant->read(tick_s * static_cast<double>(k++));
    const Decision d = ladder->step(sensors);
    limits.restrict_to(ladder->left());
    applied = limits.checked(d.command);
    plant->write(applied);
    ladder->applied(applied);
    worst = std::max(worst, d.rung);
    return d;
  }

  Campaign campaign;
  ScenarioConfig scenario;
  VariantConfig variant;
  std::unique_ptr<SimulatedPlant> plant;
  std::unique_ptr<FallbackLadder> ladder;
  CommandLimits limits;
  Command applied;
  Rung worst = Rung::fresh;
  double tick_s = 0.001;
  int k = 0;
};

// From the tick in which a coil is called failed on, no command uses it: not the controller's, and the exit lets none out. Plans
// go on: no rung below them is needed.
TEST(ValveHealthOnTheTwin, WhatIsLeftTakesTheBanksPlaceInTheSameTick) {
  for (const std::size_t v : {0u, 1u}) {
    Bench bench(v);
    const std::size_t coil = v == 0 ? 1 : 3;
    const ModeSet all = system_of(bench.variant).modes(bench.variant);
    bool found = false;
    int ticks_after = 0;
    for (int k = 0; k < 3000; ++k) {
      if (k == 1500) bench.plant->fail_switch(coil, stuck_open);
      const Decision d = bench.tick();
      if (d.failed_switch < 0) {
        EXPECT_EQ(bench.ladder->left(), nullptr);
        continue;
      }
      if (!found) {
        ASSERT_GE(k, 1500);
        EXPECT_EQ(static_cast<std::size_t>(d.failed_switch), coil);
        EXPECT_EQ(d.failed_as, SwitchFaultKind::stuck_on);
        EXPECT_TRUE(d.solved);  // the problem over what is left is posed and solved in this tick
      }
      found = true;
      ++ticks_after;
      ASSERT_NE(bench.ladder->left(), nullptr);
      EXPECT_GT(d.mode_set, 0);
      EXPECT_LT(bench.ladder->left()->size(), all.size());
      EXPECT_GE(bench.ladder->left()->find(d.command.switches), 0);
      EXPECT_EQ((bench.applied.switches >> coil) & 1u, 0u);
      EXPECT_TRUE(d.faults.has(Fault::switch_failed));
      EXPECT_FALSE(d.faults.has(Fault::switches_lost));
    }
    EXPECT_TRUE(found);
    EXPECT_GT(ticks_after, 1000);
    EXPECT_LE(bench.worst, Rung::shifted);
    EXPECT_EQ(bench.limits.refused(), 0);
    // The exit refuses what the whole bank could do.
    const SwitchPattern uses_it = all.pattern(all.find(SwitchPattern{1} << coil));
    EXPECT_EQ(bench.limits.checked({uses_it, {}}).switches, bench.ladder->left()->safe_pattern());
    EXPECT_EQ(bench.limits.refused(), 1);
  }
}

// Of a second coil that fails nothing was prepared: the ladder's SAFE, with the reason in words.
TEST(ValveHealthOnTheTwin, ASecondCoilThatFailsEndsInSafe) {
  Bench bench(0);
  Decision d;
  for (int k = 0; k < 5000 && d.rung != Rung::safe; ++k) {
    if (k == 1500) bench.plant->fail_switch(1, stuck_open);
    if (k == 2200) bench.plant->fail_switch(2, stuck_open);
    d = bench.tick();
    if (k < 2200) {
      ASSERT_NE(d.rung, Rung::safe) << k;
    }
  }
  EXPECT_EQ(d.rung, Rung::safe);
  EXPECT_TRUE(d.safe_causes.has(Fault::switches_lost));
  EXPECT_EQ(bench.applied.switches, bench.ladder->left()->safe_pattern());
}

}  // namespace
}  // namespace solenoid
