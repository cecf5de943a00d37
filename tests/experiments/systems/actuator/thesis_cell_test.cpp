#include "experiments/systems/actuator/simulation/thesis_cell.hpp"

#include "experiments/campaign/campaign.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

TEST(ThesisCell, IsFoundByTheLawAndTheTaskNotByNames) {
  VariantConfig pd = shipped_variant("thesis_pd");
  pd.name = "mine";
  ScenarioConfig task;
  task.trajectory = thesis_cycloidal(ActuatorParameters{}.equilibrium_position_m());
  const auto simulated = thesis_cell(pd, task);
  ASSERT_TRUE(simulated);
  EXPECT_EQ(simulated->table, "6-1");
  EXPECT_FALSE(simulated->measured);
  EXPECT_EQ(simulated->rmse_mm.value, 0.15);
  EXPECT_EQ(simulated->mae_mm.value, 0.61);
  EXPECT_EQ(simulated->ssa_mm->value, 0.01);
  EXPECT_TRUE(simulated->ssa_mm->upper_bound);
  actuator(task).plant = "twin";
  const auto measured = thesis_cell(pd, task);
  ASSERT_TRUE(measured);
  EXPECT_EQ(measured->table, "7-2");
  EXPECT_TRUE(measured->measured);
  task.trajectory = thesis_sine(0.0197);
  actuator(task).plane = Plane::horizontal;
  EXPECT_EQ(thesis_cell(pd, task)->table, "7-8");
  EXPECT_FALSE(thesis_cell(pd, task)->sse_mm);
}

TEST(ThesisCell, AnotherLawOrTaskHasNone) {
  const VariantConfig pd = shipped_variant("thesis_pd");
  ScenarioConfig task;
  task.trajectory = thesis_sine(0.0197);
  EXPECT_TRUE(thesis_cell(pd, task));
  EXPECT_FALSE(thesis_cell(shipped_variant("nine_pd"), task));
  EXPECT_FALSE(thesis_cell(shipped_variant("thesis_pd_ekf"), task));
  ScenarioConfig other = task;
  actuator(other).payload_kg = 0.2;
  EXPECT_FALSE(thesis_cell(pd, other));
  other = task;
  actuator(other).mismatch.friction = 1.5;
  EXPECT_FALSE(thesis_cell(pd, other));
  other = task;
  other.duration_s = 4.0;
  EXPECT_FALSE(thesis_cell(pd, other));
  other.trajectory = thesis_sine(0.05);
  other.duration_s = other.trajectory.duration_s();
  EXPECT_FALSE(thesis_cell(pd, other));
}

}  // namespace
}  // namespace solenoid
