#pragma once

#include "core/systems/actuator/dynamics.hpp"
#include "core/systems/actuator/force_residual.hpp"

namespace solenoid {

/// Indices beyond the actuator's own into the estimators' state.
enum LoadedIndex : std::size_t { disturbance = 4, payload = 5, flow_factor = 6, friction_factor = 7 };

/// The actuator with what a controller is not told as states: the HybridModel that every estimator here runs on.
///
/// state       x = (y, v, Pa, Pb, d [N], m [kg], q, r): external force on the slide, payload, factors on every valve
///             flow and on friction
/// switched    valve openings, as PneumaticActuator
/// continuous  motor force [N]
/// output      z = (y, Pa, Pb): what the sensors see, before their filters
///
///     (y, v, Pa, Pb)+ = PneumaticActuator::step_under(conditions(m, d + g(y, v), r)) with openings times q
///     d+ = (1 - dt/tau_d) d     m+ = m     q+ - 1 = (1 - dt/tau_q)(q - 1)     r+ - 1 = (1 - dt/tau_r)(r - 1)
///                                                                                        [estimators.md, section 1]
///
/// g is a residual that was identified (residual.md), none unless it is given: d is of what g leaves.
class LoadedActuator {
 public:
  static constexpr std::size_t state_size = 8, switched_size = 4, continuous_size = 1, output_size = 3;

  /// Time constants with which force and factors return to their means.
  struct Memory {
    double force_s = 0.1, flow_s = 10.0, friction_s = 10.0;
    bool operator==(const Memory&) const = default;
  };

  /// The payload of `model` is ignored: the state has its own.
  LoadedActuator(const PneumaticActuator& model, const Memory& memory, const ForceResidual& residual = {})
      : model_(model), memory_(memory), residual_(residual) {}

  const PneumaticActuator& actuator() const { return model_; }

  template <class S>
  Vector<S, 8> step(const Vector<S, 8>& x, const Vector<S, 4>& opening, const Vector<S, 1>& motor, double dt) const {
    const Vector<S, 4> scaled = {S(opening[0] * x[flow_factor]), S(opening[1] * x[flow_factor]),
                                 S(opening[2] * x[flow_factor]), S(opening[3] * x[flow_factor])};
    S external = x[disturbance];
    if (!residual_.empty()) external = external + residual_.force<S>(x[position], x[velocity]);
    const auto own = model_.step_under<S>({x[position], x[velocity], x[pressure_a], x[pressure_b]}, scaled, motor, dt,
                                          model_.conditions<S>(x[payload], external, x[friction_factor]));
    return {own[position],
            own[velocity],
            own[pressure_a],
            own[pressure_b],
            S(S(1.0 - dt / memory_.force_s) * x[disturbance]),
            x[payload],
            S(S(1.0) + S(1.0 - dt / memory_.flow_s) * (x[flow_factor] - S(1.0))),
            S(S(1.0) + S(1.0 - dt / memory_.friction_s) * (x[friction_factor] - S(1.0)))};
  }

  template <class S>
  Vector<S, 3> output(const Vector<S, 8>& x) const {
    return {x[position], x[pressure_a], x[pressure_b]};
  }

 private:
  PneumaticActuator model_;
  Memory memory_;
  ForceResidual residual_;
};

}  // namespace solenoid
