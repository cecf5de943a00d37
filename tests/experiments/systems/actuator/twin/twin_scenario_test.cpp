#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/systems/actuator/thesis/fidelity.hpp"
#include "tests/experiments/systems/actuator/twin/twin_support.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

ScenarioConfig scenario_from(const std::string& text) {
  TableReader reader = TableReader::from_text("name = \"t\"\ntrajectory = { kind = \"sine\" }\n" + text, "s.toml");
  return read_scenario(reader);
}

VariantConfig thesis_pd() {
  VariantConfig v = new_variant();
  v.integral.gain = 0.005;
  actuator(v).motor = "pd";
  return v;
}

RunResult short_run(const std::string& text, std::uint64_t seed) {
  ScenarioConfig s = scenario_from(text);
  s.duration_s = 3.0;
  return simulate(thesis_pd(), s, seed);
}

TEST(TwinScenario, IsChosenByNameAndRepeatsToTheLastBit) {
  const std::string twin = "plant = \"twin\"\nnoise = true\n";
  const Metrics first = short_run(twin, 1).metrics, again = short_run(twin, 1).metrics;
  EXPECT_EQ(first["rmse_mm"], again["rmse_mm"]);
  EXPECT_EQ(first["air_g"], again["air_g"]);
  EXPECT_TRUE(first.finite);
  EXPECT_GT(first["air_g"], 0.0);
  EXPECT_NE(first["rmse_mm"], short_run(twin, 2).metrics["rmse_mm"]);
  EXPECT_NE(first["rmse_mm"], short_run("noise = true\n", 1).metrics["rmse_mm"]);
}

TEST(TwinScenario, NoiseOffKeepsFiltersAndConverter) {
  const RunResult run = short_run("plant = \"twin\"\nnoise = false\nsensing = \"measured\"\n", 1);
  double largest = 0, oldest = 0;
  for (const TickRecord& t : run.ticks) {
    largest = std::max(largest, std::abs(t.sensors.value[position_channel] - t.sensors.truth[position]));
    oldest = std::max(oldest, std::abs(t.sensors.value[pressure_a_channel] - t.sensors.truth[pressure_a]));
  }
  EXPECT_GT(largest, 1e-6);
  EXPECT_LT(largest, 0.06 / 8191 * 1.01);
  EXPECT_GT(oldest, 2000.0);  // ten milliseconds of a filling chamber
}

TEST(TwinScenario, EveryMismatchPayloadAndPlaneChangesTheRun) {
  const std::string twin = "plant = \"twin\"\nnoise = true\n";
  const double nominal = short_run(twin, 1).metrics["rmse_mm"];
  for (const char* change :
       {"mismatch = { friction = 1.5 }", "mismatch = { flow = 0.9 }", "mismatch = { supply = 1.1 }",
        "mismatch = { delay = 1.25 }", "mismatch = { inertia = 1.2 }", "payload_kg = 0.15", "plane = \"horizontal\""})
    EXPECT_NE(nominal, short_run(twin + change, 1).metrics["rmse_mm"]) << change;
}

TEST(TwinScenario, ATwinOfItsOwnNeedsThePlant) {
  try {
    scenario_from("twin = \"other.toml\"");
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("key 'twin'"));
  }
  EXPECT_THROW(scenario_from("plant = \"twin\"\ntwin = \"no_such_file.toml\""), ConfigError);
}

/// One seed of each case of chapter 5 on a stand-in.
std::vector<Cell> one_seed(StandIn rig) {
  rig.step_seeds = 1;
  return reproduce(step_cases(rig), 2);
}

TEST(TwinFidelity, TheNominalTwinIsNearerToTheStepTestsThanTheControllersModel) {
  const auto model = one_seed(stand_ins().at(0)), twin = one_seed(stand_ins().at(1));
  EXPECT_LT(choice_criterion(twin), choice_criterion(model));
  EXPECT_LT(largest_overshoot_percent(twin, 100), 3.0);
  const auto errors = [](const Cell& c) { return c.metric == "sse_max_abs_measured_mm"; };
  EXPECT_EQ(std::ranges::count_if(twin, errors), 16);
  EXPECT_LT(mean_abs_ln(twin, errors), mean_abs_ln(model, errors));
}

TEST(TwinFidelity, TheCriterionIsTheMeanLogRatioPlusOvershootsInTensOfPercent) {
  const auto cell = [](const char* table, const char* name, const char* metric, double thesis, double ours) {
    return Cell{table, "twin", name, metric, PrintedNumber{thesis, false}, ours, 0.0, 1};
  };
  const std::vector<Cell> cells = {cell("table-5-2", "N_p = 40", "sse_max_abs_measured_mm", 1.0, std::exp(0.2)),
                                   cell("table-5-3", "payload", "sse_max_abs_measured_mm", 2.0, 2 * std::exp(-0.4)),
                                   cell("table-5-2", "N_p = 40", "sse_max_abs_mm", 1.0, 100.0),
                                   cell("table-5-2", "N_p = 40", "overshoot_measured_percent", 35.0, 30.0),
                                   cell("table-5-2", "N_p = 120", "overshoot_measured_percent", 1.0, 2.0)};
  EXPECT_NEAR(choice_criterion(cells), 0.3 + (0.5 + 0.1) / 2, 1e-12);
  EXPECT_EQ(largest_overshoot_percent(cells, 100), 2.0);
  EXPECT_EQ(largest_overshoot_percent(cells, 40), 30.0);
}

}  // namespace
}  // namespace solenoid
