#pragma once

#include "core/mpc/flatten.hpp"
#include "core/mpc/plan.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

namespace solenoid {

/// A prediction under way: the state, the commands in flight and the cost of the way so far. The order of its additions
/// is the definition of the cost to the last bit; every solver that shares this code shares its rounding.
template <HybridModel M>
struct Rollout {
  StateOf<M> state{};
  DelayLines lines;
  double cost = 0.0;
  int switches = 0;
  int step = 0;
  bool feasible = true;

  explicit Rollout(const Problem<M>& problem) : state(problem.initial), lines(problem.lines) {}
  Rollout() = default;
};

namespace rollout_detail {

template <HybridModel M, class Scalar>
Scalar weighted_square(const OutputOf<M>& weight, const OutputOf<M>& reference,
                       const Vector<Scalar, M::output_size>& output, Scalar sum) {
  for (std::size_t i = 0; i < M::output_size; ++i) {
    if (weight[i] == 0.0) continue;
    const Scalar error = Scalar(reference[i]) - output[i];
    sum = sum + Scalar(weight[i]) * (error * error);
  }
  return sum;
}

}  // namespace rollout_detail

/// Whether derivative-following solvers step the model's smooth_step in place of step.
enum class Dynamics : std::uint8_t { exact, smoothed };

/// One model step; smooth where asked for and where the model has a smooth step.
template <HybridModel M, Dynamics dynamics, class Scalar>
Vector<Scalar, M::state_size> model_step(const M& model, const Vector<Scalar, M::state_size>& x,
                                         const Vector<Scalar, M::switched_size>& s,
                                         const Vector<Scalar, M::continuous_size>& u, double dt) {
  if constexpr (dynamics == Dynamics::smoothed && HasSmoothStep<M>)
    return model.template smooth_step<Scalar>(x, s, u, dt);
  else
    return model.template step<Scalar>(x, s, u, dt);
}

/// How far x is below `lower` or above `upper`; 0 in between.
template <class Scalar>
Scalar beyond(const Scalar& x, double lower, double upper) {
  const Scalar zero(0.0);
  const Scalar low = select(x < Scalar(lower), Scalar(Scalar(lower) - x), zero);
  return select(x > Scalar(upper), Scalar(x - Scalar(upper)), low);
}

/// Step j of the prediction, and the one definition of the running cost for every scalar and solver:
///
///     running   consumption * rate(x[j], s) dt,  then  weight[i] * planned[i]^2  for each continuous input
///     x[j+1] =  step(x[j], s, feedback(x[j], setpoint[j]) + planned, dt)
///     running   penalty[i] * (what of x[j+1] is beyond its bounds)^2  for each state with softened bounds
///
/// running(term) is called with each weighted term that is not 0 by its weight, in this order.
template <HybridModel M, Dynamics dynamics, class Scalar, class Running>
inline void predict_step(const Problem<M>& problem, std::size_t j, const Vector<Scalar, M::switched_size>& switched,
                         const Vector<Scalar, M::continuous_size>& planned, Vector<Scalar, M::state_size>& state,
                         Running&& running) {
  Vector<Scalar, M::continuous_size> input = planned;
  if constexpr (HasFeedback<M>) {
    input = problem.model.template feedback<Scalar>(state, problem.setpoint[j]);
    for (std::size_t i = 0; i < M::continuous_size; ++i) input[i] = input[i] + planned[i];
  }
  if constexpr (HasConsumption<M>) {
    const double weight = problem.cost.consumption * problem.horizon.dt_s;
    if (weight != 0.0) running(Scalar(Scalar(weight) * problem.model.template consumption<Scalar>(state, switched)));
  }
  for (std::size_t i = 0; i < M::continuous_size; ++i)
    if (problem.cost.continuous[i] != 0.0)
      running(Scalar(Scalar(problem.cost.continuous[i]) * (planned[i] * planned[i])));
  state = model_step<M, dynamics, Scalar>(problem.model, state, switched, input, problem.horizon.dt_s);
  for (std::size_t i = 0; i < M::state_size; ++i)
    if (problem.bounds.state_penalty[i] != 0.0) {
      const Scalar excess = beyond<Scalar>(state[i], problem.bounds.state_lower[i], problem.bounds.state_upper[i]);
      running(Scalar(Scalar(problem.bounds.state_penalty[i]) * (excess * excess)));
    }
}

/// One model step with its share of the cost added to `cost`: the running cost, then the tracking of x[j+1].
template <HybridModel M, class Scalar>
inline void roll_step(const Problem<M>& problem, std::size_t j, const Vector<Scalar, M::switched_size>& switched,
                      const ContinuousOf<M>& planned, Vector<Scalar, M::state_size>& state, Scalar& cost) {
  Vector<Scalar, M::continuous_size> input;
  for (std::size_t i = 0; i < M::continuous_size; ++i) input[i] = Scalar(planned[i]);
  predict_step<M, Dynamics::exact, Scalar>(problem, j, switched, input, state,
                                           [&](const Scalar& term) { cost = cost + term; });
  cost = rollout_detail::weighted_square<M, Scalar>(problem.cost.tracking, problem.reference[j],
                                                    problem.model.template output<Scalar>(state), cost);
}

/// Commands `mode`, rolls one block of `length` steps, and adds its share of the cost.
/// `outputs` (empty, or all steps of the horizon) receives the predicted outputs.
///
/// Everything is inlined here, and state and cost live in locals, so that a step of the loop hands its results to the
/// next in registers: a prediction is one long dependency chain, and each detour over memory lengthens it.
template <HybridModel M>
[[SOLENOID_FLATTEN]] void roll_block(const Problem<M>& problem, const SwitchTiming& timing, int mode, int length,
                                     const ContinuousOf<M>& planned, Rollout<M>& r,
                                     std::span<OutputOf<M>> outputs = {}) noexcept {
  const SwitchPattern pattern = problem.modes.pattern(mode);
  bool feasible = r.feasible && r.lines.may_command(pattern, timing);
  const int changes = std::popcount(pattern ^ r.lines.commanded());
  r.switches += changes;
  r.lines.command(pattern, timing);
  const bool constrained = problem.bounds.constrain_state();
  const int settled = r.lines.settled_after();
  StateOf<M> state = r.state;
  double cost = r.cost + problem.cost.switching * changes;
  SwitchedOf<M> switched{};
  for (int i = 0; i < length; ++i) {
    if (i <= settled) switched = problem.modes.template inputs<M::switched_size>(r.lines.effective(i));
    const auto j = static_cast<std::size_t>(r.step + i);
    roll_step<M, double>(problem, j, switched, planned, state, cost);
    if (constrained)  // a state that is no number violates nothing: it shows in the cost, as a numerical failure
      for (std::size_t k = 0; k < M::state_size; ++k) feasible = feasible && !problem.bounds.breaks(k, state[k]);
    if (!outputs.empty()) outputs[j] = problem.model.template output<double>(state);
  }
  r.state = state;
  r.cost = cost;
  r.feasible = feasible;
  r.step += length;
  r.lines.advance(length);
}

/// Adds the terminal cost; call once after the last block.
template <HybridModel M>
double total_cost(const Problem<M>& problem, const Rollout<M>& r) noexcept {
  if (!r.feasible) return std::numeric_limits<double>::infinity();
  return rollout_detail::weighted_square<M, double>(problem.cost.terminal, problem.reference.back(),
                                                    problem.model.template output<double>(r.state), r.cost);
}

/// The independent judge: what a plan really costs. Fills the plan's predicted outputs if they are sized. Every
/// solver's result can be put to it.
template <HybridModel M>
SolveReport evaluate(const Problem<M>& problem, Plan<M>& plan) noexcept {
  const SwitchTiming timing(problem.modes, problem.horizon.dt_s);
  Rollout<M> r(problem);
  for (std::size_t b = 0; b < plan.modes.size(); ++b)
    roll_block(problem, timing, plan.modes[b], problem.horizon.blocks[b], plan.continuous[b], r,
               std::span<OutputOf<M>>(plan.outputs));
  SolveReport report;
  report.cost = total_cost(problem, r);
  report.switches = r.switches;
  report.status = !r.feasible                  ? Status::infeasible
                  : std::isfinite(report.cost) ? Status::feasible
                                               : Status::numerical_failure;
  return report;
}

/// The limit that a plan breaks first; of one command dwells, then windows, then groups, by number.
template <HybridModel M>
BrokenLimit first_broken_limit(const Problem<M>& problem, const Plan<M>& plan) noexcept {
  using Kind = BrokenLimit::Kind;
  const SwitchTiming timing(problem.modes, problem.horizon.dt_s);
  Rollout<M> r(problem);
  for (std::size_t b = 0; b < plan.modes.size(); ++b) {
    BrokenLimit broken = r.lines.broken_by(problem.modes.pattern(plan.modes[b]), timing);
    for (int i = 0; i < problem.horizon.blocks[b] && broken.kind == Kind::none; ++i) {
      roll_block(problem, timing, plan.modes[b], 1, plan.continuous[b], r);
      for (std::size_t k = 0; k < M::state_size && broken.kind == Kind::none; ++k) {
        if (!problem.bounds.breaks(k, r.state[k])) continue;
        const double low = problem.bounds.state_lower[k], high = problem.bounds.state_upper[k];
        broken = {Kind::state, 0, static_cast<int>(k), r.state[k], r.state[k] < low ? low : high};
        --r.step;
      }
    }
    broken.step = r.step;
    if (broken.kind != Kind::none) return broken;
  }
  return {};
}

}  // namespace solenoid
