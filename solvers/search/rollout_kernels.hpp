#pragma once

#include "core/systems/actuator/prestabilised.hpp"
#include "solvers/search/rollout_kernel.hpp"

#include <vector>

namespace solenoid {

/// Every compiled kernel this machine can run, slowest first: what the tests compare lane by lane with the scalar
/// rollout.
template <HybridModel M>
requires compiled_kernels<M> std::vector<RolloutKernel<M>> runnable_kernels();

}  // namespace solenoid
