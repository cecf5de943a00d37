// Compiled with this instruction set's flags (solvers/CMakeLists.txt); nothing else may be defined here.
#include "solvers/search/kernels/declare.hpp"

namespace solenoid::kernels {

RolloutKernel<PneumaticActuator> baseline(Of<PneumaticActuator>) {
  return make_rollout_kernel<PneumaticActuator, xsimd::sse2>("baseline");
}
RolloutKernel<PrestabilisedActuator> baseline(Of<PrestabilisedActuator>) {
  return make_rollout_kernel<PrestabilisedActuator, xsimd::sse2>("baseline");
}
RolloutKernel<ResidualActuator> baseline(Of<ResidualActuator>) {
  return make_rollout_kernel<ResidualActuator, xsimd::sse2>("baseline");
}

}  // namespace solenoid::kernels
