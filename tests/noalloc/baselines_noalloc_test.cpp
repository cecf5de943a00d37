// The literature's controllers: no allocation from the first tick on, nor in a solve of the extended cost.
#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/rt/allocation_guard.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/systems/actuator/simulation/model_plant.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

TEST(HotPath, BaselinesRunWithoutAllocation) {
  ASSERT_TRUE(AllocationGuard::available());
  for (const char* name : {"van_varseveld_bone", "sliding_three_mode", "sliding_seven_mode", "takemura_hybrid",
                           "qi_bone_zhang", "end_position", "servo_pid"}) {
    const VariantConfig v = shipped_variant(name);
    const Trajectory task = thesis_sine(actuator(v).nominal.equilibrium_position_m());
    ModelPlant plant(actuator(v).nominal, v.modes, task.start(), {.ideal = false, .noise = true});
    const auto controller = make_controller(v, task);
    CommandLimits limits = make_limits(v);
    MemoryRecorder recorder(1000);
    FakeClock clock;
    ControlLoop loop(plant, clock, *controller, limits, recorder);
    const std::int64_t before = AllocationGuard::thread_allocations();
    loop.run(1000, actuator_timing.tick_s);
    controller->applied(actuator_command(0, 1.0));  // what left was not what was decided
    controller->restart(1.0, {0.05});
    Measurement later = recorder.records().back().sensors;
    later.time_s += 0.05;  // ticks were skipped
    controller->step(later);
    EXPECT_EQ(AllocationGuard::thread_allocations() - before, 0) << name;
    ASSERT_EQ(recorder.records().size(), 1000u) << name;
  }
}

}  // namespace
}  // namespace solenoid
