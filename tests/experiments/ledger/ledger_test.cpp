#include "experiments/ledger/ledger.hpp"

#include "experiments/base/result.hpp"
#include "experiments/profile/shipped_instances.hpp"
#include "solvers/minlp/bonmin.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using testing::HasSubstr;

InstanceSet shipped(const std::string& variant) {
  InstanceSet set = parse_instances(shipped_instance_bytes(), shipped_instances_name);
  std::erase_if(set.variants, [&](const VariantInstances& v) { return v.name != variant; });
  return set;
}

TEST(Ledger, ChainHoldsOnRecordedStates) {
  LedgerOptions options;
  options.states = 12;
  options.bonmin_states = 0;
  const auto ledger = keep_ledger(shipped("nine_state"), options);
  ASSERT_EQ(ledger.size(), 1u);
  EXPECT_EQ(ledger[0].states.size(), 12u);
  EXPECT_TRUE(ledger[0].violations.empty());
  int below = 0;
  for (const LedgerState& state : ledger[0].states) {
    EXPECT_EQ(state.of(LedgerMethod::branch_and_bound).cost, state.bound);
    EXPECT_EQ(state.of(LedgerMethod::exhaustive).cost, state.bound);
    for (const LedgerMethod plan :
         {LedgerMethod::held, LedgerMethod::sum_up, LedgerMethod::cia, LedgerMethod::sum_up_improved,
          LedgerMethod::cia_improved, LedgerMethod::cross_entropy_100us, LedgerMethod::mppi_2ms})
      EXPECT_GE(state.of(plan).cost, state.bound) << to_string(plan);
    EXPECT_LE(state.of(LedgerMethod::sum_up_improved).cost, state.of(LedgerMethod::sum_up).cost);
    below += state.of(LedgerMethod::relaxed).cost < state.bound;
    EXPECT_FALSE(state.of(LedgerMethod::bonmin).tried);
  }
  EXPECT_GT(below, 3);
}

TEST(Ledger, WhatIsLearnedIsThereWhereItsNetworkFits) {
  LedgerOptions options;
  options.states = 40;
  options.bonmin_states = 0;
  const auto ledger = keep_ledger(shipped("nine_robust"), options);
  EXPECT_TRUE(ledger[0].violations.empty());
  int optimal = 0;
  for (const LedgerState& state : ledger[0].states) {
    EXPECT_EQ(state.of(LedgerMethod::taught_search).cost, state.bound) << "the optimum, whatever is proposed";
    for (const LedgerMethod plan : {LedgerMethod::policy, LedgerMethod::learned_tail}) {
      EXPECT_TRUE(state.of(plan).tried);
      EXPECT_GE(state.of(plan).cost, state.bound);
    }
    optimal += state.of(LedgerMethod::policy).cost == state.bound;
  }
  EXPECT_GE(optimal, 30);  // of 40: these are of other motions than it was taught on
}

/// What nobody asked for may be of no use; what somebody asked for is used or refused.
TEST(Ledger, ANetworkThatIsAskedForFitsAVariantOrIsRefusedByItsOption) {
  const test::Folder folder;
  const std::string few = "ledger --states 2 --bonmin 0 --variant ";
  const auto refusal = [&](const std::string& arguments) { return test::refusal_of(folder, few + arguments); };
  EXPECT_THAT(refusal("nine_state --policy nine_policy"), HasSubstr("--policy: 'nine_policy' fits no variant"));
  EXPECT_THAT(refusal("nine_robust --policy nine_tail"), HasSubstr("is of kind 'cost', not 'policy'"));
  EXPECT_THAT(refusal("nine_robust --cost nine_policy"), HasSubstr("--cost: 'nine_policy' fits no variant"));
  EXPECT_THAT(refusal("nine_robust --cost nobody"), HasSubstr("--cost: 'nobody' is no network"));
  EXPECT_THAT(refusal("nine_robust --policy none.toml"), HasSubstr("--policy: none.toml cannot be read"));
  const test::ProgramRun one_fits = test::run_program(folder, few + "nine_state,nine_robust --policy nine_policy");
  EXPECT_EQ(one_fits.exit_code, 0) << one_fits.err;
}

TEST(Ledger, GapsAtABoundOfZeroAndListedViolations) {
  LedgerState state;
  state.bound = 0.0;
  EXPECT_EQ(state.gap(LedgerMethod::held), 0.0);
  state.entries[static_cast<std::size_t>(LedgerMethod::held)].cost = 1.0;
  EXPECT_TRUE(std::isinf(state.gap(LedgerMethod::held)));
  LedgerOfVariant variant{"made_up", "10", {state}, {{7, "cia 1 below branch and bound 2"}}, 0};
  EXPECT_NE(result_of({variant}).text(false).find("record 7: cia 1 below"), std::string::npos);
  const auto json = nlohmann::json::parse(result_of({variant}).json());
  EXPECT_EQ(json["variants"][0]["violations"][0]["record"], 7);
}

TEST(Ledger, CommandPrintsJsonAndCsvAndRefusesUnknownVariants) {
  const test::ProgramRun json =
      test::run_program({"ledger", "--variant", "nine_state", "--states", "3", "--bonmin", "0", "--format", "json"});
  EXPECT_EQ(json.exit_code, 0);
  const auto parsed = nlohmann::json::parse(json.out);
  EXPECT_EQ(parsed["variants"][0]["states"], 3);
  EXPECT_EQ(parsed["variants"][0]["methods"].size(), 14u);
  const test::ProgramRun csv =
      test::run_program({"ledger", "--variant", "nine_state", "--states", "2", "--bonmin", "0", "--format", "csv"});
  EXPECT_EQ(std::count(csv.out.begin(), csv.out.end(), '\n'), 1 + 2 * 14);
  EXPECT_EQ(test::run_program({"ledger", "--variant", "nothing"}).exit_code, 2);
}

}  // namespace
}  // namespace solenoid
