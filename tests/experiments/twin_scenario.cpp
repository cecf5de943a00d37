#include "experiments/twin/fidelity.hpp"
#include "tests/experiments/twin_support.hpp"

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
  VariantConfig v;
  v.integral.gain = 0.005;
  v.motor = "pd";
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
  EXPECT_EQ(first.rmse_mm, again.rmse_mm);
  EXPECT_EQ(first.air_g, again.air_g);
  EXPECT_TRUE(first.finite);
  EXPECT_GT(first.air_g, 0.0);
  EXPECT_NE(first.rmse_mm, short_run(twin, 2).metrics.rmse_mm);
  EXPECT_NE(first.rmse_mm, short_run("noise = true\n", 1).metrics.rmse_mm);
}

TEST(TwinScenario, NoiseOffKeepsFiltersAndConverter) {
  const RunResult run = short_run("plant = \"twin\"\nnoise = false\nsensing = \"measured\"\n", 1);
  double largest = 0, oldest = 0;
  for (const TickRecord& t : run.ticks) {
    largest = std::max(largest, std::abs(t.sensors.position_m - t.sensors.truth[position]));
    oldest = std::max(oldest, std::abs(t.sensors.pressure_a_pa - t.sensors.truth[pressure_a]));
  }
  EXPECT_GT(largest, 1e-6);
  EXPECT_LT(largest, 0.06 / 8191 * 1.01);
  EXPECT_GT(oldest, 2000.0);  // ten milliseconds of a filling chamber
}

TEST(TwinScenario, EveryMismatchPayloadAndPlaneChangesTheRun) {
  const std::string twin = "plant = \"twin\"\nnoise = true\n";
  const double nominal = short_run(twin, 1).metrics.rmse_mm;
  for (const char* change :
       {"mismatch = { friction = 1.5 }", "mismatch = { flow = 0.9 }", "mismatch = { supply = 1.1 }",
        "mismatch = { delay = 1.25 }", "mismatch = { inertia = 1.2 }", "payload_kg = 0.15", "plane = \"horizontal\""})
    EXPECT_NE(nominal, short_run(twin + change, 1).metrics.rmse_mm) << change;
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

TEST(TwinFidelity, MeasuredMetricsOfAKnownRun) {
  Trajectory step(0.02);
  step.step_to(0.08, 1.0).steady_from(0.5);
  std::vector<TickRecord> ticks;
  for (int k = 0; k < 1000; ++k) {
    TickRecord t;
    t.sensors.time_s = 1e-3 * k;
    t.decision.reference = step.at(t.sensors.time_s);
    t.decision.estimate[position] = k < 500 ? 0.083 : (k % 2 ? 0.076 : 0.078);
    ticks.push_back(t);
  }
  const MeasuredMetrics m = measured_metrics(ticks, step);
  EXPECT_NEAR(m.sse_max_abs_mm, 4.0, 1e-9);
  EXPECT_NEAR(m.sse_abs_mean_mm, 3.0, 1e-9);
  EXPECT_NEAR(m.ssa_mm, 2.0, 1e-9);
  EXPECT_NEAR(m.mae_mm, 4.0, 1e-9);
  EXPECT_NEAR(m.rmse_mm, std::sqrt((9.0 + (16.0 + 4.0) / 2) / 2), 1e-9);
  EXPECT_NEAR(m.overshoot_percent, 100 * (63.0 - 57.0) / 57.0, 1e-9);
}

TEST(TwinFidelity, TheNominalTwinIsNearerToTheStepTestsThanTheControllersModel) {
  FidelityRig twin, model;
  model.plant = "model";
  const auto ours = chapter5_cells(twin), theirs = chapter5_cells(model);
  ASSERT_EQ(ours.size(), 26u);
  EXPECT_LT(choice_criterion(ours), choice_criterion(theirs));
  EXPECT_LT(largest_overshoot(ours, 100), 3.0);
  const auto errors = [](const FidelityCell& c) { return c.metric == "sse_mm"; };
  EXPECT_LT(mean_abs_log_ratio(ours, errors), mean_abs_log_ratio(theirs, errors));
}

}  // namespace
}  // namespace solenoid
