#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/rt/allocation_guard.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/systems/actuator/simulation/model_plant.hpp"
#include "solvers/search/exhaustive.hpp"

#include <cmath>
#include <cstdlib>
#include <memory>

#include <Eigen/Dense>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

template <class Work>
std::int64_t allocations_of(Work work) {
  const std::int64_t before = AllocationGuard::thread_allocations();
  work();
  return AllocationGuard::thread_allocations() - before;
}

void* volatile sink;            // keeps the optimiser from removing an allocation
void* volatile none = nullptr;  // ... and from making a malloc of a realloc

TEST(AllocationGuard, CountsEveryWayToAllocate) {
  ASSERT_TRUE(AllocationGuard::available());
  const auto counted_and_freed = [](auto allocate) {
    return allocations_of([&] {
      sink = allocate();
      std::free(sink);
    });
  };
  EXPECT_EQ(counted_and_freed([] { return std::malloc(16); }), 1);
  EXPECT_EQ(counted_and_freed([] { return std::calloc(4, 4); }), 1);
  EXPECT_EQ(counted_and_freed([] { return std::realloc(none, 16); }), 1);
  EXPECT_GE(counted_and_freed([] { return std::aligned_alloc(64, 128); }), 1);
  EXPECT_GE(counted_and_freed([] {
              void* at = nullptr;
              return posix_memalign(&at, 64, 128) == 0 ? at : nullptr;
            }),
            1);
  EXPECT_GE(allocations_of([] {
              sink = ::operator new(16);
              ::operator delete(sink);
            }),
            1);
  EXPECT_GE(allocations_of([] {
              Eigen::MatrixXd m(7, 7);
              sink = m.data();
            }),
            1);
  EXPECT_EQ(allocations_of([] {}), 0);
}

VariantConfig variant(const char* valves, const char* motor) {
  VariantConfig v = new_variant();
  v.modes = valves;
  actuator(v).motor = motor;
  v.integral.gain = 0.005;
  v.cost.switching = 1e-8;
  v.cost.consumption = 1e-6;
  v.horizon.blocks = {2, 4, 14};
  return v;
}

/// Solves to the end, with a deadline already over, and with a state that is no number: none may allocate.
template <class M>
void solves_without_allocation(Solver<M>& solver, const char* valves, Status to_the_end = Status::optimal) {
  Problem<M> problem = make_problem<M>(variant(valves, HasFeedback<M> ? "in_prediction" : "none"));
  problem.initial = {0.05, 0.1, 150e3, 150e3};
  solver.prepare(problem);
  Plan<M> plan(problem);
  SolveReport report;
  EXPECT_EQ(allocations_of([&] { report = solver.solve(problem, plan, Deadline::never()); }), 0);
  EXPECT_EQ(report.status, to_the_end);
  const Deadline over(Deadline::Clock::now());
  EXPECT_EQ(allocations_of([&] { report = solver.solve(problem, plan, over); }), 0);
  EXPECT_EQ(report.status, Status::deadline_reached);
  problem.initial[velocity] = std::nan("");
  EXPECT_EQ(allocations_of([&] { report = solver.solve(problem, plan, Deadline::never()); }), 0);
  EXPECT_EQ(report.status, Status::numerical_failure);
}

TEST(HotPath, SearchesSolveWithoutAllocation) {
  for (const char* valves : {"three_way", "two_way"}) {
    Exhaustive<PneumaticActuator> scalar;
    solves_without_allocation<PneumaticActuator>(scalar, valves);
    for (const char* name : {"exhaustive", "branch_and_bound"}) {
      solves_without_allocation<PneumaticActuator>(*make_solver<PneumaticActuator>(name), valves);
      solves_without_allocation<PrestabilisedActuator>(*make_solver<PrestabilisedActuator>(name), valves);
    }
  }
}

TEST(HotPath, SamplersSolveWithoutAllocation) {
  for (const char* name : {"cross_entropy", "mppi"}) {
    const auto solver = make_solver<PrestabilisedActuator>(name);
    solves_without_allocation<PrestabilisedActuator>(*solver, "two_way", Status::feasible);
  }
}

void expect_a_loop_without_allocation(const VariantConfig& v) {
  const Trajectory task = thesis_sine(actuator(v).nominal.equilibrium_position_m());
  ModelPlant plant(actuator(v).nominal, v.modes, task.start(), {.ideal = false, .noise = true});
  const auto controller = make_controller(v, task);
  CommandLimits limits = make_limits(v);
  MemoryRecorder recorder(100);
  FakeClock clock;
  ControlLoop loop(plant, clock, *controller, limits, recorder);
  EXPECT_EQ(allocations_of([&] { loop.run(100, actuator_timing.tick_s); }), 0);
  ASSERT_EQ(recorder.records().size(), 100u);
  const Measurement sensors = recorder.records().back().sensors;
  EXPECT_EQ(allocations_of([&] { controller->step(sensors); }), 0);
}

TEST(HotPath, ControllerAndLoopRunWithoutAllocation) {
  for (const char* motor : {"none", "pd", "inverse_dynamics", "in_prediction"}) {
    SCOPED_TRACE(motor);
    expect_a_loop_without_allocation(variant("two_way", motor));
  }
}

TEST(HotPath, SoTheyDoOnServoValves) {
  for (const char* motor : {"none", "in_prediction", "joint"}) {
    SCOPED_TRACE(motor);
    VariantConfig v = variant("servo", motor);
    v.solver = "sqp";
    v.estimator = "payload_ekf";
    expect_a_loop_without_allocation(v);
  }
}

}  // namespace
}  // namespace solenoid
