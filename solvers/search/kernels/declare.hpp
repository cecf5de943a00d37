#pragma once

#include "core/systems/actuator/residual_actuator.hpp"
#include "solvers/search/rollout_kernel.hpp"

namespace solenoid::kernels {

/// Names a model to choose an overload by.
template <class M>
struct Of {};

RolloutKernel<PneumaticActuator> baseline(Of<PneumaticActuator>);
RolloutKernel<PneumaticActuator> avx2(Of<PneumaticActuator>);
RolloutKernel<PneumaticActuator> avx512(Of<PneumaticActuator>);
RolloutKernel<PrestabilisedActuator> baseline(Of<PrestabilisedActuator>);
RolloutKernel<PrestabilisedActuator> avx2(Of<PrestabilisedActuator>);
RolloutKernel<PrestabilisedActuator> avx512(Of<PrestabilisedActuator>);
RolloutKernel<ResidualActuator> baseline(Of<ResidualActuator>);
RolloutKernel<ResidualActuator> avx2(Of<ResidualActuator>);
RolloutKernel<ResidualActuator> avx512(Of<ResidualActuator>);

}  // namespace solenoid::kernels
