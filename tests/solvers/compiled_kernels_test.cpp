// What a program gets that includes the search's own header and a model, and nothing else of the library.
#include "core/systems/actuator/prestabilised.hpp"
#include "solvers/search/branch_and_bound.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

class Mine : public PneumaticActuator {};

static_assert(compiled_kernels<PneumaticActuator> && compiled_kernels<PrestabilisedActuator>);
static_assert(!compiled_kernels<Mine>);

TEST(CompiledKernels, AreWhatTheSearchsHeaderAloneGivesTheLibrarysOwnModels) {
  EXPECT_EQ(&rollout_kernel<PneumaticActuator>(), &compiled_kernel<PneumaticActuator>());
  EXPECT_EQ(&rollout_kernel<PrestabilisedActuator>(), &compiled_kernel<PrestabilisedActuator>());
  const int widest =
      __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") ? 8
      : __builtin_cpu_supports("avx2")                                                                              ? 4
                                                                                                                    : 2;
  EXPECT_EQ(rollout_kernel<PneumaticActuator>().width, widest);
  EXPECT_EQ(rollout_kernel<PrestabilisedActuator>().width, widest);
}

TEST(CompiledKernels, OfAModelDerivedFromOursAreTheProgramsOwn) {
  EXPECT_STREQ(rollout_kernel<Mine>().architecture, xsimd::default_arch::name());
  BranchAndBound<Mine> search;  // builds
}

}  // namespace
}  // namespace solenoid
