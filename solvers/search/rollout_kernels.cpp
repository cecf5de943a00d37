#include "solvers/search/rollout_kernels.hpp"

#include "solvers/search/kernels/declare.hpp"

namespace solenoid {

template <HybridModel M>
requires compiled_kernels<M> std::vector<RolloutKernel<M>> runnable_kernels() {
  const kernels::Of<M> model{};
  std::vector<RolloutKernel<M>> all = {kernels::baseline(model)};
  if (__builtin_cpu_supports("avx2")) all.push_back(kernels::avx2(model));
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    all.push_back(kernels::avx512(model));
  return all;
}

template <HybridModel M>
requires compiled_kernels<M>
const RolloutKernel<M>& compiled_kernel() {
  static const RolloutKernel<M> kernel = runnable_kernels<M>().back();
  return kernel;
}

template std::vector<RolloutKernel<PneumaticActuator>> runnable_kernels<PneumaticActuator>();
template std::vector<RolloutKernel<PrestabilisedActuator>> runnable_kernels<PrestabilisedActuator>();
template std::vector<RolloutKernel<ResidualActuator>> runnable_kernels<ResidualActuator>();
template const RolloutKernel<PneumaticActuator>& compiled_kernel<PneumaticActuator>();
template const RolloutKernel<PrestabilisedActuator>& compiled_kernel<PrestabilisedActuator>();
template const RolloutKernel<ResidualActuator>& compiled_kernel<ResidualActuator>();

}  // namespace solenoid
