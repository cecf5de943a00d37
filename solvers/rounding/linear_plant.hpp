#pragma once

#include "core/mpc/relaxation.hpp"
#include "solvers/relaxed/dual.hpp"

#include <array>
#include <vector>

namespace solenoid {

/// A plant about a point, x+ = A x + B b, z = C x, driven by its switch states b in effect.
/// shapes   a: states x states    b: states x switches    c: outputs x states, all row-major    weight: outputs
struct LinearPlant {
  std::size_t states = 0, switches = 0, outputs = 0;
  std::vector<double> a, b, c;
  std::vector<double> weight;  ///< of the squared output errors against each other

  LinearPlant() = default;
  /// Sized, all 0.
  LinearPlant(std::size_t state_count, std::size_t switch_count, std::size_t output_count)
      : states(state_count),
        switches(switch_count),
        outputs(output_count),
        a(states * states),
        b(states * switches),
        c(outputs * states),
        weight(outputs) {}
};

/// A plant of a problem's sizes.
template <HybridModel M>
LinearPlant linear_plant(const Problem<M>& problem) {
  return {M::state_size, static_cast<std::size_t>(problem.modes.switch_count()), M::output_size};
}

/// The problem's model about its initial state at switch states `at` and the planned continuous input, by forward
/// differentiation of one step (smoothed, where the model has that) with the model's own feedback, and of the outputs.
/// An output weighs what its error costs that lasts for the horizon: steps * tracking + terminal. No allocation.
template <HybridModel M>
void linearise(const Problem<M>& problem, const SwitchStates<double>& at, const ContinuousOf<M>& planned,
               LinearPlant& plant) noexcept {
  constexpr std::size_t nx = M::state_size, ns = M::switched_size, directions = nx + ns;
  using D = Dual<static_cast<int>(directions)>;
  std::array<double, D::size> d{};
  Vector<D, nx> x;
  for (std::size_t i = 0; i < nx; ++i) x[i] = D(problem.initial[i], static_cast<int>(i));
  const auto mean = switched_inputs<M, double>(problem.modes, at);
  Vector<D, ns> s;
  for (std::size_t i = 0; i < ns; ++i) s[i] = D(mean[i], static_cast<int>(nx + i));
  Vector<D, M::continuous_size> u;
  for (std::size_t i = 0; i < M::continuous_size; ++i) u[i] = D(planned[i]);
  const Vector<D, M::output_size> z = problem.model.template output<D>(x);
  for (std::size_t o = 0; o < M::output_size; ++o) {
    z[o].copy_derivatives(d.data());
    std::copy_n(d.begin(), nx, plant.c.begin() + static_cast<std::ptrdiff_t>(o * nx));
    plant.weight[o] =
        static_cast<double>(problem.reference.size()) * problem.cost.tracking[o] + problem.cost.terminal[o];
  }
  predict_step<M, Dynamics::smoothed, D>(problem, 0, s, u, x, [](const D&) {});
  for (std::size_t i = 0; i < nx; ++i) {
    x[i].copy_derivatives(d.data());
    std::copy_n(d.begin(), nx, plant.a.begin() + static_cast<std::ptrdiff_t>(i * nx));
    for (std::size_t c = 0; c < plant.switches; ++c) {
      double sum = 0.0;
      for (std::size_t k = 0; k < ns; ++k) sum += d[nx + k] * problem.modes.gain(c)[k];
      plant.b[i * plant.switches + c] = sum;
    }
  }
}

/// By how much switch c being on for one step more moves state i, in the linear plant.
inline double push(const LinearPlant& plant, std::size_t i, std::size_t c) noexcept {
  return plant.b[i * plant.switches + c];
}

}  // namespace solenoid
