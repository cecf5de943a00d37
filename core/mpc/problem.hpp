#pragma once

#include "core/mpc/hybrid_model.hpp"
#include "core/mpc/mode_set.hpp"

#include <limits>
#include <numeric>
#include <stdexcept>
#include <vector>

namespace solenoid {

/// The prediction grid: `blocks` holds the length, in model steps of dt_s, of each block in which the mode is held.
struct Horizon {
  double dt_s = 0.001;
  std::vector<int> blocks;

  /// The model steps of all blocks, N.
  int steps() const { return std::accumulate(blocks.begin(), blocks.end(), 0); }
};

/// Weights of the cost below. Zero switches a term off.
template <HybridModel M>
struct Cost {
  OutputOf<M> tracking{};        ///< on the squared output error of every step
  OutputOf<M> terminal{};        ///< on the squared output error after the last step
  double switching = 0.0;        ///< on each change of each switch
  double consumption = 0.0;      ///< on the integral of the model's consumption
  ContinuousOf<M> continuous{};  ///< on the squared continuous input of every step
};

/// Box bounds on the predicted states (hard: a sequence that violates one is infeasible) and the continuous input.
template <HybridModel M>
struct Bounds {
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  StateOf<M> state_lower = filled<M::state_size>(-infinity), state_upper = filled<M::state_size>(infinity);
  ContinuousOf<M> continuous_lower = filled<M::continuous_size>(-infinity);
  ContinuousOf<M> continuous_upper = filled<M::continuous_size>(infinity);

  /// Whether any state is bounded.
  bool constrain_state() const {
    for (std::size_t i = 0; i < M::state_size; ++i)
      if (state_lower[i] > -infinity || state_upper[i] < infinity) return true;
    return false;
  }

 private:
  template <std::size_t size>
  static Vector<double, size> filled(double value) {
    Vector<double, size> v{};
    v.fill(value);
    return v;
  }
};

/// One mixed-integer optimal control problem over a finite horizon.                              [theory.md, eq. 1]
///
///     minimise   sum_{j=1..N} |r[j] - z[j]|^2_tracking + |r[N] - z[N]|^2_terminal + switching * (switch changes)
///                + consumption * sum_j rate(x[j], s[j]) dt + sum_j |u[j]|^2_continuous
///     over       mode[b] in modes, u[b],  b < blocks
///     subject to x[j+1] = step(x[j], s[j], u[j], dt),  x[0] = initial,  s[j] = modes.point(switch states in effect),
///                the switch states following the commands through `lines` (edges in flight, delays, dwell), bounds
///
/// where N steps are predicted and step j leads from x[j] to x[j+1]. Plain data, sized once.
/// shapes   reference: N, reference[j] belongs to x[j+1]
///          setpoint: N for a model with feedback, else empty; setpoint[j] is what its law tracks at x[j]
template <HybridModel M>
struct Problem {
  M model;
  ModeSet modes;
  Horizon horizon;
  Cost<M> cost;
  Bounds<M> bounds;

  StateOf<M> initial{};
  DelayLines lines;
  std::vector<OutputOf<M>> reference;
  std::vector<OutputOf<M>> setpoint;

  /// A problem of these parts with a zero reference. Throws std::invalid_argument, naming the part.
  Problem(M dynamics, ModeSet mode_set, Horizon grid, Cost<M> weights, Bounds<M> limits = {})
      : model(std::move(dynamics)),
        modes(std::move(mode_set)),
        horizon(std::move(grid)),
        cost(weights),
        bounds(limits),
        reference(static_cast<std::size_t>(horizon.steps())),
        setpoint(HasFeedback<M> ? reference.size() : 0) {
    if (modes.switched_size() != M::switched_size)
      throw std::invalid_argument("mode set '" + modes.name() + "' does not map to the model's switched inputs");
    if (horizon.blocks.empty() || !(horizon.dt_s > 0)) throw std::invalid_argument("horizon: needs blocks and dt > 0");
    for (const int length : horizon.blocks)
      if (length < 1) throw std::invalid_argument("horizon: every block needs at least one step");
  }
};

}  // namespace solenoid
