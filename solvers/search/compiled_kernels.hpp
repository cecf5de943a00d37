#pragma once

namespace solenoid {

class PneumaticActuator;
class PrestabilisedActuator;
class ResidualActuator;

/// Whether the library has a model's kernels, compiled for several instruction sets: then rollout_kernel<M>() is linked,
/// not instantiated. The names alone are here, so that every search sees them and learns nothing of the models.
template <class M>
inline constexpr bool compiled_kernels = false;
/// The library has them.
template <>
inline constexpr bool compiled_kernels<PneumaticActuator> = true;
/// The library has them.
template <>
inline constexpr bool compiled_kernels<PrestabilisedActuator> = true;
/// The library has them.
template <>
inline constexpr bool compiled_kernels<ResidualActuator> = true;

}  // namespace solenoid
