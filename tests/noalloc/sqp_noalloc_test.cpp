#include "core/rt/allocation_guard.hpp"
#include "tests/support/tracking_sqp.hpp"

#include <set>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using test::TrackingSlide;
using Slide = Sqp<TrackingSlide, 2, 0>;

TEST(SqpNoAlloc, SolveAndRealTimeIterationAtEveryStatus) {
  ASSERT_TRUE(AllocationGuard::available());
  const auto recorded = test::recorded_nlps();
  const RelaxedGrid grid = control_grid(recorded[0].problem.horizon, 1);
  std::set<Status> seen;
  const auto fenced = [&](Slide& sqp, const Problem<TrackingSlide>& problem, Deadline deadline) {
    RelaxedPlan<TrackingSlide> plan(problem, grid);
    const auto before = AllocationGuard::thread_allocations();
    const SolveReport report = sqp.solve(problem, plan, deadline);
    sqp.anticipate(problem, plan);
    sqp.solve(problem, plan, deadline);
    EXPECT_EQ(AllocationGuard::thread_allocations(), before) << to_string(report.status);
    seen.insert(report.status);
  };
  Slide full, one_step({.max_iterations = 1}), refusing({.tolerance = 0.0, .defect = 0.0, .refusals = 0});
  for (Slide* sqp : {&full, &one_step, &refusing}) sqp->prepare(recorded[0].problem, grid);
  for (const auto& one : recorded)
    for (Slide* sqp : {&full, &one_step, &refusing}) fenced(*sqp, one.problem, Deadline::never());
  fenced(full, recorded[0].problem, Deadline::after(std::chrono::nanoseconds(0)));
  auto broken = recorded[0].problem;
  broken.initial[0] = std::nan("");
  fenced(full, broken, Deadline::never());
  auto bounded = recorded[0].problem;
  bounded.bounds.state_lower[0] = 0.2;
  Slide with_bounds;
  with_bounds.prepare(bounded, grid);
  fenced(with_bounds, bounded, Deadline::never());
  EXPECT_EQ(seen, (std::set<Status>{Status::optimal, Status::feasible, Status::deadline_reached,
                                    Status::iteration_limit, Status::infeasible, Status::numerical_failure}));
}

}  // namespace
}  // namespace solenoid
