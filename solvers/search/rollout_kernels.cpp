#include "solvers/search/rollout_kernels.hpp"

#include "solvers/search/kernels/declare.hpp"

namespace solenoid {
namespace {

template <class M, class Tag>
std::vector<RolloutKernel<M>> runnable() {
  std::vector<RolloutKernel<M>> all = {kernels::baseline(Tag{})};
  if (__builtin_cpu_supports("avx2")) all.push_back(kernels::avx2(Tag{}));
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    all.push_back(kernels::avx512(Tag{}));
  return all;
}

}  // namespace

template <>
std::vector<RolloutKernel<PneumaticActuator>> runnable_kernels<PneumaticActuator>() {
  return runnable<PneumaticActuator, kernels::PneumaticTag>();
}
template <>
std::vector<RolloutKernel<PrestabilisedActuator>> runnable_kernels<PrestabilisedActuator>() {
  return runnable<PrestabilisedActuator, kernels::PrestabilisedTag>();
}

template <>
const RolloutKernel<PneumaticActuator>& rollout_kernel<PneumaticActuator>() {
  static const auto kernel = runnable_kernels<PneumaticActuator>().back();
  return kernel;
}
template <>
const RolloutKernel<PrestabilisedActuator>& rollout_kernel<PrestabilisedActuator>() {
  static const auto kernel = runnable_kernels<PrestabilisedActuator>().back();
  return kernel;
}

}  // namespace solenoid
