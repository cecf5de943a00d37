#pragma once

#include "core/actuator/prestabilised.hpp"
#include "solvers/search/rollout_kernel.hpp"

namespace solenoid {

/// The library's own models: kernels compiled for several instruction sets, the best this machine has chosen at run
/// time.
template <>
const RolloutKernel<PneumaticActuator>& rollout_kernel<PneumaticActuator>();
template <>
const RolloutKernel<PrestabilisedActuator>& rollout_kernel<PrestabilisedActuator>();

/// Every kernel this machine can run, slowest first: what the tests compare lane by lane with the scalar rollout.
template <HybridModel M>
std::vector<RolloutKernel<M>> runnable_kernels();
template <>
std::vector<RolloutKernel<PneumaticActuator>> runnable_kernels<PneumaticActuator>();
template <>
std::vector<RolloutKernel<PrestabilisedActuator>> runnable_kernels<PrestabilisedActuator>();

}  // namespace solenoid
