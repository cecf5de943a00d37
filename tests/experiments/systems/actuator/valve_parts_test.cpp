// What valve configurations cost and how long they last.
#include "experiments/systems/actuator/simulation/valve_parts.hpp"

#include "core/reference/trajectory.hpp"
#include "core/systems/actuator/metrics.hpp"
#include "core/systems/actuator/valves.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

TEST(ValveParts, EveryConfigurationHasAPriceAndALife) {
  for (const std::string& name : valve_configurations()) {
    if (name == "servo") continue;
    const ValveHardware& hardware = valve_hardware(name);
    EXPECT_EQ(hardware.valves, valve_modes(name, {}).switch_count()) << name;  // a coil a valve
    EXPECT_EQ(hardware.price_usd, 40.0 * hardware.valves) << name << ": the thesis's $40 a solenoid valve";
    EXPECT_TRUE(hardware.rated_changes.has_value()) << name;
  }
  EXPECT_EQ(valve_hardware("servo").price_usd, 2 * 800.0);  // and $800 a servo valve
  EXPECT_FALSE(valve_hardware("servo").rated_changes.has_value());
  EXPECT_EQ(valve_hardware("of a plug-in").valves, 0);
}

TEST(ValveParts, LifeIsRatedChangesOverTheRateOfTheBusiestCoil) {
  const ValveHardware hardware{.valves = 1, .price_usd = 40.0, .rated_changes = 365.25 * 24 * 3600 * 10};
  EXPECT_DOUBLE_EQ(life_years(hardware, 10.0), 1.0);
  EXPECT_DOUBLE_EQ(life_years(hardware, 2.0), 5.0);
  EXPECT_EQ(life_years(hardware, 0.0), 1000.0);
  EXPECT_EQ(life_years(hardware, 1e-9), 1000.0);
  EXPECT_EQ(life_years({}, 10.0), 0.0);  // nothing switches
}

TEST(ValveParts, TheBusiestCoilIsTheOneThatChangesMost) {
  std::vector<TickRecord> ticks(1000);
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    ticks[k].sensors.time_s = 0.001 * static_cast<double>(k);
    const SwitchPattern slow = k / 100 % 2, fast = k / 25 % 2, last = k >= 500;
    ticks[k].applied.switches = slow | (fast << 3) | (last << 31);
  }
  const Metrics m = evaluate_actuator_run(ticks, Trajectory(0.0), 0.001, {}, 5000.0);
  EXPECT_DOUBLE_EQ(m.number("coil_switches"), 9 + 39 + 1);
  EXPECT_DOUBLE_EQ(m.number("busiest_coil_per_s"), 39.0);
}

}  // namespace
}  // namespace solenoid
