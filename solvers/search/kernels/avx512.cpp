// Compiled with this instruction set's flags (solvers/CMakeLists.txt); nothing else may be defined here.
#include "solvers/search/kernels/declare.hpp"

namespace solenoid::kernels {

RolloutKernel<PneumaticActuator> avx512(Of<PneumaticActuator>) {
  return make_rollout_kernel<PneumaticActuator, xsimd::avx512f, xsimd::avx2>("avx512");
}
RolloutKernel<PrestabilisedActuator> avx512(Of<PrestabilisedActuator>) {
  return make_rollout_kernel<PrestabilisedActuator, xsimd::avx512f, xsimd::avx2>("avx512");
}
RolloutKernel<ResidualActuator> avx512(Of<ResidualActuator>) {
  return make_rollout_kernel<ResidualActuator, xsimd::avx512f, xsimd::avx2>("avx512");
}

}  // namespace solenoid::kernels
