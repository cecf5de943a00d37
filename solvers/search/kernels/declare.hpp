#pragma once

#include "core/actuator/prestabilised.hpp"
#include "solvers/search/rollout_kernel.hpp"

namespace solenoid::kernels {

struct PneumaticTag {};
struct PrestabilisedTag {};

RolloutKernel<PneumaticActuator> baseline(PneumaticTag);
RolloutKernel<PneumaticActuator> avx2(PneumaticTag);
RolloutKernel<PneumaticActuator> avx512(PneumaticTag);
RolloutKernel<PrestabilisedActuator> baseline(PrestabilisedTag);
RolloutKernel<PrestabilisedActuator> avx2(PrestabilisedTag);
RolloutKernel<PrestabilisedActuator> avx512(PrestabilisedTag);

}  // namespace solenoid::kernels
