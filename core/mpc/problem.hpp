#pragma once

#include "core/mpc/any_problem.hpp"
#include "core/mpc/hybrid_model.hpp"

#include <algorithm>
#include <limits>
#include <vector>

namespace solenoid {

template <HybridModel M>
struct Plan;

/// Weights of the cost below. Zero switches a term off.
template <HybridModel M>
struct Cost {
  OutputOf<M> tracking{};        ///< on the squared output error of every step
  OutputOf<M> terminal{};        ///< on the squared output error after the last step
  double switching = 0.0;        ///< on each change of each switch
  double consumption = 0.0;      ///< on the integral of the model's consumption
  ContinuousOf<M> continuous{};  ///< on the squared continuous input of every step
};

/// Box bounds on the predicted states and the continuous input. A sequence that takes a state beyond its bounds is
/// infeasible, unless the bounds are softened: then each step beyond costs penalty * excess^2.
template <HybridModel M>
struct Bounds {
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  StateOf<M> state_lower = filled<M::state_size>(-infinity), state_upper = filled<M::state_size>(infinity);
  StateOf<M> state_penalty{};  ///< [1/unit2], which softens; 0: hard
  ContinuousOf<M> continuous_lower = filled<M::continuous_size>(-infinity);
  ContinuousOf<M> continuous_upper = filled<M::continuous_size>(infinity);

  /// Whether any state has hard bounds.
  bool constrain_state() const {
    for (std::size_t i = 0; i < M::state_size; ++i)
      if (state_penalty[i] == 0.0 && (state_lower[i] > -infinity || state_upper[i] < infinity)) return true;
    return false;
  }
  /// Whether x is no value of state i: beyond hard bounds.
  bool breaks(std::size_t i, double x) const {
    return state_penalty[i] == 0.0 && (x < state_lower[i] || x > state_upper[i]);
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
///                + sum_{j=1..N} |x[j] beyond its bounds|^2_penalty, of softened bounds
///     over       mode[b] in modes, u[b],  b < blocks
///     subject to x[j+1] = step(x[j], s[j], u[j], dt),  x[0] = initial,  s[j] = modes.point(switch states in effect),
///                the switch states following the commands through `lines` (edges in flight, delays, dwell), bounds
///
/// where N steps are predicted and step j leads from x[j] to x[j+1]. Plain data, sized once.
/// shapes   reference: N, reference[j] belongs to x[j+1]
///          setpoint: N for a model with feedback, else empty; setpoint[j] is what its law tracks at x[j]
template <HybridModel M>
struct Problem final : AnyProblem {
  M model;
  Cost<M> cost;
  Bounds<M> bounds;

  StateOf<M> initial{};
  std::vector<OutputOf<M>> reference;
  std::vector<OutputOf<M>> setpoint;

  /// A problem of these parts with a zero reference. Throws std::invalid_argument, naming the part.
  Problem(M dynamics, ModeSet mode_set, Horizon grid, Cost<M> weights, Bounds<M> limits = {})
      : AnyProblem(std::move(mode_set), std::move(grid), M::switched_size),
        model(std::move(dynamics)),
        cost(weights),
        bounds(limits),
        reference(static_cast<std::size_t>(horizon.steps())),
        setpoint(HasFeedback<M> ? reference.size() : 0) {}

  std::unique_ptr<AnyProblem> clone() const override { return std::make_unique<Problem>(*this); }
  std::unique_ptr<AnyPlan> new_plan() const override { return std::make_unique<Plan<M>>(*this); }
  void copy_conditions(const AnyProblem& other) noexcept override {
    const auto& from = static_cast<const Problem&>(other);
    model = from.model;
    cost = from.cost;
    bounds = from.bounds;
    initial = from.initial;
    lines = from.lines;
    begins = from.begins;
    mode_set = from.mode_set;
    std::ranges::copy(from.reference, reference.begin());
    std::ranges::copy(from.setpoint, setpoint.begin());
  }
  std::type_index model_type() const noexcept override { return typeid(M); }
  ModelSizes sizes() const noexcept override {
    ModelSizes s{M::state_size, M::switched_size, M::continuous_size, M::output_size};
    if constexpr (HasLoad<M>) s.load = M::load_size;
    return s;
  }
  std::span<double> initial_values() noexcept override { return initial; }
  std::span<const double> initial_values() const noexcept override { return initial; }
  std::span<double> reference_values() noexcept override { return in_a_row(reference); }
  std::span<const double> reference_values() const noexcept override { return in_a_row(reference); }
  std::span<double> setpoint_values() noexcept override { return in_a_row(setpoint); }
  std::span<const double> setpoint_values() const noexcept override { return in_a_row(setpoint); }
  std::span<const double> input_lower() const noexcept override { return bounds.continuous_lower; }
  std::span<const double> input_upper() const noexcept override { return bounds.continuous_upper; }
  void get_load(std::span<double> into) const noexcept override {
    if constexpr (HasLoad<M>) std::ranges::copy(model.load(), into.begin());
  }
  void set_load(std::span<const double> load) noexcept override {
    if constexpr (HasLoad<M>) {
      Vector<double, M::load_size> values;
      std::copy_n(load.begin(), values.size(), values.begin());
      model.set_load(values);
    }
  }
};

/// What to do. Solvers read it as their warm start and leave their best plan in it.
/// shapes   modes, continuous: blocks    outputs: empty, or steps (evaluate() fills it; outputs[j] after step j + 1)
template <HybridModel M>
struct Plan final : AnyPlan {
  std::vector<ContinuousOf<M>> continuous;
  std::vector<OutputOf<M>> outputs;

  Plan() = default;
  /// Sized for a problem: mode 0 and no continuous input in every block.
  explicit Plan(const Problem<M>& problem) : continuous(problem.horizon.blocks.size()) {
    modes.resize(continuous.size());
    relaxation.weights.resize(modes.size() * static_cast<std::size_t>(problem.modes.size()));
    relaxation.owed.resize(modes.size());
    relaxation.owed_sum.resize(modes.size());
  }

  std::unique_ptr<AnyPlan> clone() const override { return std::make_unique<Plan>(*this); }
  void assign(const AnyPlan& other) noexcept override { *this = static_cast<const Plan&>(other); }
  void resize(std::size_t blocks) override {
    modes.resize(blocks);
    continuous.resize(blocks);
    relaxation.owed.resize(blocks);
    relaxation.owed_sum.resize(blocks);
  }
  std::span<double> inputs() noexcept override { return in_a_row(continuous); }
  std::span<const double> inputs() const noexcept override { return in_a_row(continuous); }
};

}  // namespace solenoid
