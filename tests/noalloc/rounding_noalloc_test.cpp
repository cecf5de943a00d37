#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
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

template <HybridModel M>
void expect_fenced_solver(const VariantConfig& variant) {
  auto problem = make_problem<M>(variant);
  problem.initial = {0.05, 0.1, 150e3, 150e3};
  for (auto& r : problem.reference) r = {0.06, 0.0};
  for (auto& r : problem.setpoint) r = {0.06, 0.0};
  const auto solver = make_solver<M>(variant);
  solver->prepare(problem);
  Plan<M> plan(problem);
  const Status ended = fenced([&] { return solver->solve(problem, plan, Deadline::never()); }).status;
  EXPECT_TRUE(ended == Status::feasible || (ended == Status::iteration_limit && variant.solver == "sqp"));
  EXPECT_EQ(fenced([&] { return solver->solve(problem, plan, Deadline(Deadline::Clock::now())); }).status,
            Status::deadline_reached);
  problem.initial[velocity] = std::nan("");
  EXPECT_EQ(fenced([&] { return solver->solve(problem, plan, Deadline::never()); }).status, Status::numerical_failure);
}

TEST(RoundingNoAlloc, RelaxedAndRoundedVariantsSolveWithoutAllocation) {
  ASSERT_TRUE(AllocationGuard::available());
  for (const char* valves : {"three_way", "two_way"})
    for (const char* solver : {"sum_up_rounding", "cia", "sqp"})
      for (const char* motor : {"none", "in_prediction", "joint"}) {
        VariantConfig variant = new_variant();
        variant.modes = valves;
        variant.solver = solver;
        actuator(variant).motor = motor;
        variant.cost.continuous[0] = 1e-12;
        variant.cost.switching = 2e-8;
        variant.cost.consumption = 1e-6;
        variant.horizon.blocks = {2, 4, 14};
        if (predicts_motor(variant))
          expect_fenced_solver<PrestabilisedActuator>(variant);
        else
          expect_fenced_solver<PneumaticActuator>(variant);
      }
}

TEST(RoundingNoAlloc, ModulatedVariantsSolveWithoutAllocation) {
  ASSERT_TRUE(AllocationGuard::available());
  for (const char* kind : {"pulse_width", "delta_sigma", "delta_sigma_2", "dynamic_quantiser"})
    for (const bool informed : {false, true}) {
      VariantConfig variant = new_variant();
      variant.modes = "two_way";
      variant.solver = "sqp";
      variant.modulation = {.kind = kind, .informed = informed};
      variant.horizon.steps = 40;
      actuator(variant).motor = "in_prediction";
      expect_fenced_solver<PrestabilisedActuator>(variant);
    }
}

}  // namespace
}  // namespace solenoid
