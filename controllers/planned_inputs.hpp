#pragma once

#include "core/mpc/hybrid_model.hpp"
#include "core/rt/controller.hpp"

#include <concepts>

namespace solenoid {

/// A model may know the nearest state that its plant can be in: predictions start there when a measurement is noisy.
template <class M>
concept HasNearestValid = requires(const M& model, const StateOf<M>& state) {
  { model.nearest_valid(state) } -> std::same_as<StateOf<M>>;
};

/// The nearest state that the model's plant can be in, or the state itself.
template <HybridModel M>
StateOf<M> nearest_valid(const M& model, const StateOf<M>& state) noexcept {
  if constexpr (HasNearestValid<M>)
    return model.nearest_valid(state);
  else
    return state;
}

/// A model may take over what an estimator finds beyond the state.
template <class M>
concept Believes = requires(M& model, const EstimateDetail& found) {
  model.believe(found);
};

/// The continuous inputs of a system that has no law beside its plans: what the plan says. A system with laws of its own,
/// or whose model has feedback, has a class with these two functions.
/// promise  no allocation, lock or exception
template <HybridModel M>
struct PlannedInputs {
  /// Takes over what the estimator found beyond the state.
  void believe(const EstimateDetail& found, M& model) noexcept {
    if constexpr (Believes<M>) model.believe(found);
  }
  /// The inputs in a tick at this state, for the plan's own share.
  ContinuousOf<M> apply(const M&, const ReferenceSample&, const StateOf<M>&,
                        const ContinuousOf<M>& planned) const noexcept {
    return planned;
  }
};

/// Inputs may command something else than the model's inputs, what becomes of it at the plant being these.
template <class Inputs, class U>
concept HasCommanded = requires(const Inputs& inputs, const U& input) {
  { inputs.commanded(input) } -> std::same_as<U>;
};

/// What is commanded for the model's inputs; those themselves, unless the Inputs say otherwise.
template <class Inputs, class U>
U commanded(const Inputs& inputs, const U& input) noexcept {
  if constexpr (HasCommanded<Inputs, U>)
    return inputs.commanded(input);
  else
    return input;
}

}  // namespace solenoid
