#include "controllers/estimators/extended_kalman.hpp"
#include "controllers/estimators/offset_free.hpp"
#include "core/rt/allocation_guard.hpp"
#include "core/systems/actuator/dynamics.hpp"
#include "core/systems/actuator/signals.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

TEST(ExtendedKalmanAllocations, UpdateAllocatesNothing) {
  using M = PneumaticActuator;
  ASSERT_TRUE(AllocationGuard::available());
  KalmanSetup<M> setup;
  setup.channels = {KalmanChannel<M>::of(position, 3e-5), KalmanChannel<M>::of(pressure_a, 100.0, 0.0, 10),
                    KalmanChannel<M>::of(pressure_b, 100.0, 0.0, 10)};
  setup.disturbances = {{.states = {0.0, 1.0}, .sigma = 2.0, .memory_s = 1.0}};
  setup.process_sigma = {0.0, 0.01, 5e3, 5e3};
  setup.start = {0.05, 0.0, 1.5e5, 1.5e5}, setup.start_sigma = {1e-3, 0.1, 1e4, 1e4};
  ExtendedKalman<M> filter(M(), setup, actuator_timing.tick_s);
  WithDisturbance<M> predicted;
  std::int64_t allocations = 0;
  double sum = 0.0;
  for (int k = 0; k < 500; ++k) {
    std::array<double, 3> measured = {0.05, 1.5e5, 1.5e5};
    if (k == 300) measured[0] = std::nan("");
    if (k > 400) measured[0] += 0.02;  // a start anew among them
    const std::int64_t before = AllocationGuard::thread_allocations();
    sum += filter.update(measured)[0] + filter.sigma()[0] + filter.innovation() + filter.covariance()(0, 0);
    filter.applied({1, 0, 0, 1}, {k == 200 ? std::nan("") : 1.0});
    predicted.set_disturbance(filter.disturbance_rate());
    sum += predicted.step<double>(filter.state(), {1, 0, 0, 1}, {0.0}, actuator_timing.tick_s)[0];
    allocations += AllocationGuard::thread_allocations() - before;
  }
  EXPECT_TRUE(std::isfinite(sum));
  EXPECT_GE(filter.starts(), 3);
  EXPECT_EQ(allocations, 0);
}

}  // namespace
}  // namespace solenoid
