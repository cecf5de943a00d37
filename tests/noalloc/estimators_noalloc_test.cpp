#include "controllers/catalogue.hpp"
#include "core/rt/allocation_guard.hpp"
#include "core/systems/actuator/signals.hpp"
#include "tests/support/drawn_world.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

class EstimatorAllocations : public testing::TestWithParam<const char*> {};

TEST_P(EstimatorAllocations, UpdateAllocatesNothing) {
  ASSERT_TRUE(AllocationGuard::available());
  DrawnWorld world(moderate_tuning(), 1);
  Estimator estimator = make_estimator(GetParam(), PneumaticActuator(), estimator_row(GetParam()).tuning);
  std::int64_t allocations = 0;
  for (int k = 0; k < 500; ++k) {
    Measurement s = world.sensors();
    world.advance(s);
    if (k == 300) s.value[position_channel] = std::nan("");
    if (k > 400) s.value[position_channel] += 0.02;  // a start anew among them
    const std::int64_t before = AllocationGuard::thread_allocations();
    estimator.update(s);
    estimator.applied(world.opening(), {world.motor_n()});
    estimator.detail();
    allocations += AllocationGuard::thread_allocations() - before;
  }
  EXPECT_EQ(allocations, 0);
}

INSTANTIATE_TEST_SUITE_P(All, EstimatorAllocations, testing::Values("thesis", "ekf", "payload_ekf", "mhe"));

}  // namespace
}  // namespace solenoid
