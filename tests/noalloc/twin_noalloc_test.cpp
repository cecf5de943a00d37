#include "core/rt/allocation_guard.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/systems/actuator/twin/twin_plant.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

TEST(NoAllocation, TheTwinInTheModeCampaignsUse) {
  ASSERT_TRUE(AllocationGuard::available());
  TwinPlant plant(nominal_twin(), "two_way", 0.05, {false, true, 1});
  const std::int64_t before = AllocationGuard::thread_allocations();
  double sum = 0;
  for (int k = 0; k < 500; ++k) {
    sum += plant.read(1e-3 * k).value[position_channel];
    plant.write({static_cast<SwitchPattern>(k / 5 % 3), 1.0});
  }
  EXPECT_EQ(AllocationGuard::thread_allocations() - before, 0);
  EXPECT_GT(sum, 0.0);
}

}  // namespace
}  // namespace solenoid
