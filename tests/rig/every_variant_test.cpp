// Every shipped variant as the rig runs it: solver in a thread on simulated time, ladder, exit; skipped ticks, late, hanging
// and spoilt plans, SAFE and a task begun anew.
#include "controllers/catalogue.hpp"
#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_guard.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/rig/fault_table.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// The rig is the actuator's; the others have their runs in any_system_run_test.cpp.
bool runs_on_the_rig(const VariantConfig& v) {
  if (system_of(v).name() != "actuator") return false;
  const SolverRow* row = find_row(system_of(v).solvers(), v.solver);
  return !row || row->real_time;
}

std::vector<std::string> variants_for_the_rig() {
  std::vector<std::string> names;
  for (const VariantConfig& v : shipped_variants())
    if (runs_on_the_rig(v)) names.push_back(v.name);
  return names;
}

class EveryVariant : public testing::TestWithParam<std::string> {
 protected:
  EveryVariant() : campaign(read_campaign("rig", {{GetParam()}, {"cycloidal"}})) {}
  const VariantConfig& variant() const { return campaign.variants.front(); }
  ScenarioConfig scenario() const { return campaign.scenarios.front(); }
  bool plans() const { return !variant().is_feedback_law(); }
  FaultOutcome after(const std::string& fault, double until_s, double rearm_s = -1.0) const {
    return simulate_fault(GetParam(), fault, fault, true, until_s, rearm_s);
  }

  Campaign campaign;
};

/// Bursts of skipped ticks, in and across slots: caught up with, no worse than a late plan, and forgotten soon.
TEST_P(EveryVariant, CatchesUpWithSkippedTicks) {
  const auto ladder = make_ladder(variant(), scenario().trajectory, actuator_ladder(), {});
  const auto plant = make_plant(variant(), scenario(), 1);
  CommandLimits limits = make_limits(variant());
  const ModeSet modes = valve_modes(variant().modes, actuator(variant()).nominal);
  Decision d;
  double worst_m = 0.0;
  for (int k = 0; k < 1200; ++k) {
    if (k == 303 || k == 611) k += 2;
    if (k == 404 || k == 808) k += 9;  // a slot and more
    const double time_s = 1e-3 * k;
    const Measurement sensors = plant->read(time_s);
    d = ladder->step(sensors);
    const Command left = limits.checked(d.command);
    EXPECT_EQ(left, d.command) << k;
    EXPECT_GE(modes.find(left.switches), 0) << k;
    EXPECT_LE(d.rung, Rung::shifted) << k;
    plant->write(left);
    ladder->applied(left);
    worst_m = std::max(worst_m, std::abs(d.reference.axis[0].value - sensors.truth[position]));
  }
  EXPECT_EQ(d.rung, Rung::fresh);
  EXPECT_TRUE(d.planned);
  EXPECT_LT(worst_m, 0.012);
}

TEST_P(EveryVariant, GoesOnWithItsLaterBlocksWhileASolveIsLate) {
  const FaultOutcome late = after("solver:late=7@3.5+0.2", 4.5);
  EXPECT_TRUE(late.in_range);
  EXPECT_EQ(late.last, Rung::fresh);
  EXPECT_EQ(late.worst, plans() ? Rung::shifted : Rung::fresh);
}

TEST_P(EveryVariant, IsReplacedRungByRungWhenItsSolverHangs) {
  const FaultOutcome hung = after("solver:hang@3.5", 6.5);
  EXPECT_TRUE(hung.in_range);
  if (!plans()) {
    EXPECT_EQ(hung.last, Rung::fresh);  // a law has no solver
    return;
  }
  EXPECT_EQ(hung.last, Rung::safe);
  EXPECT_EQ(hung.final_command, Command());
  EXPECT_TRUE(hung.causes.has(Fault::no_plan));
}

TEST_P(EveryVariant, NeverFollowsAPlanOfNoNumbers) {
  const FaultOutcome spoilt = after("solver:nan@3.5+0.1", 4.5);
  EXPECT_TRUE(spoilt.in_range);
  EXPECT_EQ(spoilt.last, Rung::fresh);
}

TEST_P(EveryVariant, BeginsTheTaskAnewAfterSafe) {
  const FaultOutcome again = after("position:garbage@1+0.3", 4.0, 1.8);
  EXPECT_TRUE(again.in_range);
  EXPECT_EQ(again.worst, Rung::safe);
  EXPECT_EQ(again.note, "re-armed");
  EXPECT_EQ(again.last, Rung::fresh);
}

INSTANTIATE_TEST_SUITE_P(Shipped, EveryVariant, testing::ValuesIn(variants_for_the_rig()),
                         [](const auto& info) { return info.param; });

TEST(NotRealTime, IsRefusedWithWhatToRunInstead) {
  int refused = 0;
  for (const VariantConfig& v : shipped_variants()) {
    if (runs_on_the_rig(v) || system_of(v).name() != "actuator") {
      EXPECT_NO_THROW(require_real_time(v)) << v.name;
      continue;
    }
    ++refused;
    try {
      require_real_time(v);
      ADD_FAILURE() << v.name;
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find(v.name), std::string::npos);
      EXPECT_NE(std::string(error.what()).find("allowed on a plant in real time: "), std::string::npos);
    }
  }
  EXPECT_EQ(refused, 1);  // relaxed_ipopt
}

}  // namespace
}  // namespace solenoid
