#include "core/rt/allocation_guard.hpp"
#include "solvers/rounding/integral_approximation.hpp"
#include "solvers/rounding/sum_up_rounding.hpp"
#include "tests/support/random_weights.hpp"

#include <set>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

template <class Work>
auto fenced(Work work) {
  const auto before = AllocationGuard::thread_allocations();
  auto result = work();
  EXPECT_EQ(AllocationGuard::thread_allocations(), before);
  return result;
}

TEST(RoundingNoAlloc, SumUpRoundingAndIntegralApproximationAtEveryStatus) {
  ASSERT_TRUE(AllocationGuard::available());
  static_assert(noexcept(std::declval<IntegralApproximation&>().solve(
      std::declval<const ModeWeights&>(), std::declval<const SwitchLimits&>(), std::declval<std::span<int>>(),
      std::declval<Deadline>())));
  std::set<Status> seen;
  std::mt19937_64 random(1);
  ModeWeights weights = test::random_weights(random, 4, 30, true);
  std::vector<int> modes(30);
  std::vector<double> owed(4);
  fenced([&] { return sum_up_rounding(weights, modes, owed); });
  SwitchLimits limits = one_hot_limits(4);
  limits.max_changes = 12;
  const auto solve = [&](std::int64_t most, Deadline deadline) {
    IntegralApproximation search({.max_nodes = most});
    search.prepare(30, 4, 4);
    for (int again = 0; again < 2; ++again)
      seen.insert(fenced([&] { return search.solve(weights, limits, modes, deadline); }).status);
  };
  solve(2000, Deadline::never());
  solve(1 << 30, Deadline(Deadline::Clock::now()));
  limits.in_force = 0;
  limits.max_changes = 0;
  solve(2000, Deadline::never());
  limits.max_changes = 1;
  solve(2000, Deadline::never());
  weights.weight[7] = std::nan("");
  solve(2000, Deadline::never());
  EXPECT_EQ(seen, (std::set<Status>{Status::optimal, Status::iteration_limit, Status::deadline_reached,
                                    Status::infeasible, Status::numerical_failure}));
}

}  // namespace
}  // namespace solenoid
