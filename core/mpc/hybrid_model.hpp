#pragma once

#include "core/mpc/scalar.hpp"

#include <concepts>
#include <cstddef>

namespace solenoid {

/// A hybrid model is a discrete-time system with switched and continuous inputs,
///
///     x[j+1] = step(x[j], s[j], u[j], dt),     z[j] = output(x[j])
///
/// shapes   x: state_size    s: switched_size, real numbers (a mode is a point, see ModeSet)
///          u: continuous_size    z: output_size
/// promise  step and output are generic over the scalar, free of allocation and exceptions, and branch through select.
template <class M>
concept HybridModel = requires(const M& model, const Vector<double, M::state_size>& state,
                               const Vector<double, M::switched_size>& switched,
                               const Vector<double, M::continuous_size>& continuous, double dt) {
  { model.template step<double>(state, switched, continuous, dt) } -> std::same_as<Vector<double, M::state_size>>;
  { model.template output<double>(state) } -> std::same_as<Vector<double, M::output_size>>;
};

/// A model may have a consumption: a rate [unit/s] that the cost weighs, integrated over the prediction.
template <class M>
concept HasConsumption = requires(const M& model, const Vector<double, M::state_size>& state,
                                  const Vector<double, M::switched_size>& switched) {
  { model.template consumption<double>(state, switched) } -> std::same_as<double>;
};

/// A model may have a pre-stabilising law inside the prediction. The continuous input applied in a step is
/// feedback(x, setpoint) plus the plan's own share; the model saturates the sum.
template <class M>
concept HasFeedback = requires(const M& model, const Vector<double, M::state_size>& state,
                               const Vector<double, M::output_size>& setpoint) {
  { model.template feedback<double>(state, setpoint) } -> std::same_as<Vector<double, M::continuous_size>>;
};

/// A model may have a step() with its kinks and jumps rounded off, for solvers that follow derivatives; it states the
/// error. Plans found with it are judged by step().
template <class M>
concept HasSmoothStep = requires(const M& model, const Vector<double, M::state_size>& state,
                                 const Vector<double, M::switched_size>& switched,
                                 const Vector<double, M::continuous_size>& continuous, double dt) {
  {
    model.template smooth_step<double>(state, switched, continuous, dt)
    } -> std::same_as<Vector<double, M::state_size>>;
};

/// A model may say by how much its states typically change over a horizon, and solvers scale by it; without it they
/// take the states to be of order 1.
template <class M>
concept HasStateScale = requires(const M& model) {
  { model.state_scale() } -> std::same_as<Vector<double, M::state_size>>;
};

/// A model may have an enclosure, from which searches derive lower bounds. It replaces the box [low, high] by one that
/// holds the image under step() (with feedback, if there is one) of each of its points, for switched inputs anywhere in
/// theirs.
/// Outputs must not decrease with any state.
template <class M>
concept HasEnclosure = requires(const M& model, Vector<double, M::state_size>& low, Vector<double, M::state_size>& high,
                                const Vector<double, M::switched_size>& switched_low,
                                const Vector<double, M::switched_size>& switched_high,
                                const Vector<double, M::output_size>& setpoint,
                                const Vector<double, M::continuous_size>& planned, double dt) {
  model.template enclose_step<double>(low, high, switched_low, switched_high, setpoint, planned, dt);
};

/// A model may take over what an estimator found beyond the state, a load, as so many numbers.
template <class M>
concept HasLoad = requires(M& model, const M& same, const Vector<double, M::load_size>& load) {
  model.set_load(load);
  { same.load() } -> std::same_as<Vector<double, M::load_size>>;
};

/// A model's state x.
template <class M>
using StateOf = Vector<double, M::state_size>;
/// A model's switched inputs s, as real numbers.
template <class M>
using SwitchedOf = Vector<double, M::switched_size>;
/// A model's continuous inputs u.
template <class M>
using ContinuousOf = Vector<double, M::continuous_size>;
/// A model's outputs z.
template <class M>
using OutputOf = Vector<double, M::output_size>;

}  // namespace solenoid
