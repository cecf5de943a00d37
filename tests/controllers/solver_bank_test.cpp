#include "controllers/solver_bank.hpp"

#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/mpc/switch_fault.hpp"
#include "core/systems/actuator/dynamics.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// A tree search over nine states, or what is left of them.
AnySolverPtr search() { return make_solver<PneumaticActuator>("branch_and_bound"); }

VariantConfig variant() {
  VariantConfig v = new_variant();
  v.modes = "two_way";
  v.horizon = {100, {4, 16}};
  v.cost.tracking[0] = 1.0;
  return v;
}

// What the bank finds over what is left of the valves is what a solver finds that was made for that set alone, to the last bit.
TEST(SolverBank, SolvesOverEachSetAsItsOwnSolverDoes) {
  Problem<PneumaticActuator> problem = make_problem<PneumaticActuator>(variant());
  std::vector<std::optional<ModeSet>> sets = {std::nullopt};  // of one nothing is left: the others keep their numbers
  for (std::size_t c = 0; c < 4; ++c)
    for (const SwitchFaultKind kind : {SwitchFaultKind::stuck_on, SwitchFaultKind::stuck_off})
      sets.push_back(with_fault(problem.modes, c, {kind}, problem.horizon.dt_s));
  std::vector<SolverBank::Spare> spares;
  spares.reserve(sets.size());
  for (const auto& set : sets) spares.emplace_back(set, set ? search() : nullptr);
  SolverBank bank(search(), std::move(spares));
  bank.prepare(problem);
  problem.initial = {0.05, 0.05, 150e3, 140e3};
  for (auto& r : problem.reference) r = {0.06, 0.0};
  for (std::size_t k = 0; k <= sets.size(); ++k) {
    if (k > 0 && !sets[k - 1]) continue;
    Problem<PneumaticActuator> own = problem;
    if (k > 0) own.modes = *sets[k - 1];
    const AnySolverPtr alone = search();
    alone->prepare(own);
    Plan<PneumaticActuator> expected(own), found(own);
    const SolveReport single = alone->solve(own, expected, Deadline::never());
    problem.mode_set = static_cast<int>(k);
    const SolveReport banked = bank.solve(problem, found, Deadline::never());
    EXPECT_EQ(banked.status, single.status) << k;
    EXPECT_EQ(banked.cost, single.cost) << k;
    EXPECT_EQ(found.modes, expected.modes) << k;
  }
}

}  // namespace
}  // namespace solenoid
