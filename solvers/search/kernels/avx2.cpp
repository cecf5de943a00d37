// Compiled with this instruction set's flags (solvers/CMakeLists.txt); nothing else may be defined here.
#include "solvers/search/kernels/declare.hpp"

namespace solenoid::kernels {

RolloutKernel<PneumaticActuator> avx2(Of<PneumaticActuator>) {
  return make_rollout_kernel<PneumaticActuator, xsimd::avx2>("avx2");
}
RolloutKernel<PrestabilisedActuator> avx2(Of<PrestabilisedActuator>) {
  return make_rollout_kernel<PrestabilisedActuator, xsimd::avx2>("avx2");
}
RolloutKernel<ResidualActuator> avx2(Of<ResidualActuator>) {
  return make_rollout_kernel<ResidualActuator, xsimd::avx2>("avx2");
}

}  // namespace solenoid::kernels
