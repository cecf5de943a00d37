#include "controllers/factory.hpp"
#include "core/rt/allocation_guard.hpp"
#include "experiments/campaign/campaign.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// A solve from a moving state, and one from a state that is no number.
void expect_no_allocation(const VariantConfig& v) {
  const auto problem = system_of(v).problem(v);
  const auto solver = make_solver(v);
  solver->prepare(*problem);
  const auto plan = problem->new_plan();
  const double state[] = {0.05, 0.1, 150e3, 150e3};
  std::ranges::copy(state, problem->initial_values().begin());
  SolveReport report;
  const auto solve = [&] {
    const std::int64_t before = AllocationGuard::thread_allocations();
    report = solver->solve(*problem, *plan, Deadline::never());
    return AllocationGuard::thread_allocations() - before;
  };
  EXPECT_EQ(solve(), 0) << v.name;
  EXPECT_TRUE(usable(report.status));
  problem->initial_values()[1] = std::nan("");
  EXPECT_EQ(solve(), 0) << v.name;
  EXPECT_EQ(report.status, Status::numerical_failure);
}

TEST(LearnedHotPath, TaughtSolversSolveWithoutAllocation) {
  ASSERT_TRUE(AllocationGuard::available());
  for (const char* name : {"nine_policy", "nine_learned_tail"}) expect_no_allocation(shipped_variant(name));
  VariantConfig helped = shipped_variant("nine_policy");
  helped.solver = "branch_and_bound";
  expect_no_allocation(helped);
}

}  // namespace
}  // namespace solenoid
