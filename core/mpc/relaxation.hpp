#pragma once

#include "core/mpc/deadline.hpp"
#include "core/mpc/phases.hpp"
#include "core/mpc/plan.hpp"
#include "core/mpc/rollout.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace solenoid {

/// The intervals, in model steps, in each of which the relaxed inputs are held.
struct RelaxedGrid {
  std::vector<int> intervals;

  std::size_t size() const { return intervals.size(); }
};

/// Each block of the horizon cut into intervals of `period` steps (0: uncut), the rest of a block an interval of its
/// own; then neighbours joined until none is shorter than `least` steps, as relaxing needs of the longest switch delay.
inline RelaxedGrid control_grid(const Horizon& horizon, int period, int least = 1) {
  RelaxedGrid grid;
  int open = 0;
  for (const int length : horizon.blocks)
    for (int left = length, piece = 0; left > 0; left -= piece) {
      piece = period > 0 ? std::min(period, left) : left;
      open += piece;
      if (open < least) continue;
      grid.intervals.push_back(open);
      open = 0;
    }
  if (open > 0 && grid.intervals.empty()) grid.intervals.push_back(0);
  if (open > 0) grid.intervals.back() += open;
  return grid;
}

/// A point of the relaxed problem: per interval a convex combination of the modes and the continuous input.
///
/// shapes   weights: intervals x modes, interval-major, rows nonnegative with sum 1   continuous: intervals
///          outputs: empty, or steps (filled by solvers and relaxed_cost; outputs[j] after step j + 1)
template <HybridModel M>
struct RelaxedPlan {
  std::size_t modes = 0;
  std::vector<double> weights;
  std::vector<ContinuousOf<M>> continuous;
  std::vector<OutputOf<M>> outputs;

  RelaxedPlan() = default;
  /// All modes alike, continuous inputs 0.
  RelaxedPlan(const Problem<M>& problem, const RelaxedGrid& grid)
      : modes(static_cast<std::size_t>(problem.modes.size())),
        weights(grid.size() * modes, 1.0 / static_cast<double>(modes)),
        continuous(grid.size()),
        outputs(problem.reference.size()) {}

  std::size_t intervals() const { return continuous.size(); }
  std::span<double> row(std::size_t k) { return std::span(weights).subspan(k * modes, modes); }
  std::span<const double> row(std::size_t k) const { return std::span(weights).subspan(k * modes, modes); }
};

/// A plan as a point of the relaxed problem: each interval takes what the plan holds in the block it begins in, the
/// relaxed weights where they are known and else the mode. With intervals that cut blocks and nothing else, the relaxed
/// cost of an integer plan is its cost.
template <HybridModel M>
void relax_plan(const Problem<M>& problem, const RelaxedGrid& grid, const Plan<M>& plan,
                RelaxedPlan<M>& relaxed) noexcept {
  std::size_t block = 0;
  int begin = 0, block_end = problem.horizon.blocks[0];
  for (std::size_t k = 0; k < grid.size(); begin += grid.intervals[k], ++k) {
    while (begin >= block_end && block + 1 < plan.modes.size()) block_end += problem.horizon.blocks[++block];
    const std::span<double> row = relaxed.row(k);
    if (plan.relaxation.known) {
      std::copy_n(plan.relaxation.weights.begin() + static_cast<std::ptrdiff_t>(block * row.size()), row.size(),
                  row.begin());
    } else {
      std::fill(row.begin(), row.end(), 0.0);
      row[static_cast<std::size_t>(plan.modes[block])] = 1.0;
    }
    relaxed.continuous[k] = plan.continuous[block];
  }
}

/// The reverse: each block takes the relaxed weights and the continuous input of the interval it begins in.
template <HybridModel M>
void keep_relaxation(const Problem<M>& problem, const RelaxedGrid& grid, const RelaxedPlan<M>& relaxed,
                     Plan<M>& plan) noexcept {
  std::size_t k = 0;
  int begin = 0, end = grid.intervals[0];
  for (std::size_t b = 0; b < plan.modes.size(); begin += problem.horizon.blocks[b], ++b) {
    while (begin >= end && k + 1 < grid.size()) end += grid.intervals[++k];
    const std::span<const double> row = relaxed.row(k);
    std::copy(row.begin(), row.end(), plan.relaxation.weights.begin() + static_cast<std::ptrdiff_t>(b * row.size()));
    plan.continuous[b] = relaxed.continuous[k];
  }
  plan.relaxation.known = true;
}

/// What a convex combination of modes commands: c = sum_m w_m pattern_m.
template <class Scalar>
SwitchStates<Scalar> commanded_states(const ModeSet& modes, std::span<const Scalar> weights) noexcept {
  SwitchStates<Scalar> states;
  states.fill(Scalar(0.0));
  for (int m = 0; m < modes.size(); ++m)
    for (std::size_t c = 0; c < static_cast<std::size_t>(modes.switch_count()); ++c)
      if ((modes.pattern(m) >> c) & 1u) states[c] = states[c] + weights[static_cast<std::size_t>(m)];
  return states;
}

/// The pattern as real numbers.
template <class Scalar>
SwitchStates<Scalar> pattern_states(SwitchPattern pattern) noexcept {
  SwitchStates<Scalar> states;
  for (std::size_t c = 0; c < max_switches; ++c) states[c] = Scalar(static_cast<double>((pattern >> c) & 1u));
  return states;
}

/// The state in effect of a switch `after` steps after it was commanded to c, when without that command it would have
/// been l. Multilinear, and at c, l in {0, 1} what DelayLines does:                        [theory-relaxed.md, eq. 3]
///
///     l before both delays, c after both; in between  l c  (fall < rise)  or  1 - (1 - l)(1 - c)  (rise < fall)
template <class Scalar>
Scalar effective_state(const Scalar& l, const Scalar& c, int after, int rise, int fall) noexcept {
  if (after >= std::max(rise, fall)) return c;
  if (after < std::min(rise, fall)) return l;
  return fall < rise ? Scalar(l * c) : Scalar(l + c - l * c);
}

/// The model's switched inputs at real switch states, by the mode set's affine map.
template <HybridModel M, class Scalar>
Vector<Scalar, M::switched_size> switched_inputs(const ModeSet& modes, const SwitchStates<Scalar>& states) noexcept {
  const auto offset = modes.template inputs<M::switched_size>(0);
  Vector<Scalar, M::switched_size> inputs;
  for (std::size_t i = 0; i < M::switched_size; ++i) inputs[i] = Scalar(offset[i]);
  for (std::size_t c = 0; c < static_cast<std::size_t>(modes.switch_count()); ++c) {
    const auto on = modes.template inputs<M::switched_size>(SwitchPattern{1} << c);
    for (std::size_t i = 0; i < M::switched_size; ++i)
      if (const double gain = on[i] - offset[i]; gain != 0.0) inputs[i] = inputs[i] + Scalar(gain) * states[c];
  }
  return inputs;
}

/// The relaxed switching cost of one switch, d = c_k - c_{k-1}: (sqrt(d^2 + e^2) - e) / (sqrt(1 + e^2) - e), e = 0.05.
/// Smooth and convex with the values 0 at 0 and 1 at -1 and 1; hence not above |d|, and exact for switches that are
/// switched. [theory-relaxed.md, eq. 4]
inline constexpr double switching_roundness = 0.05;
/// The cost of one switch's change by d; see switching_roundness.
template <class Scalar>
Scalar relaxed_switch_change(const Scalar& d) noexcept {
  using std::sqrt;
  constexpr double e = switching_roundness;
  const double scale = 1.0 / (std::sqrt(1.0 + e * e) - e);
  return Scalar(scale) * (sqrt(Scalar(d * d + Scalar(e * e))) - Scalar(e));
}

/// One interval of the relaxed problem: `length` steps from step `first` on under commanded switch states c, after
/// `previous` (in the first interval the commands in flight count, previous is then what is in force), and the planned
/// continuous input: predict_step() at switched inputs that follow the commands.
///
/// step(j, state) is called after each step with its index j in the horizon; running(term) as predict_step() does.
template <HybridModel M, Dynamics dynamics, class Scalar, class Step, class Running>
void roll_interval(const Problem<M>& problem, const SwitchTiming& timing, int first, int length,
                   const SwitchStates<Scalar>& previous, const SwitchStates<Scalar>& c,
                   const Vector<Scalar, M::continuous_size>& planned, Vector<Scalar, M::state_size>& x, Step&& step,
                   Running&& running) {
  const auto switches = static_cast<std::size_t>(problem.modes.switch_count());
  Vector<Scalar, M::switched_size> s{};
  SwitchStates<Scalar> in_effect = c;
  for (int i = 0; i < length; ++i) {
    if (i <= timing.longest_delay) {
      const SwitchPattern in_flight = first == 0 ? problem.lines.effective(i) : 0;
      for (std::size_t k = 0; k < switches; ++k) {
        const Scalar l = first == 0 ? Scalar(static_cast<double>((in_flight >> k) & 1u)) : previous[k];
        in_effect[k] = effective_state<Scalar>(l, c[k], i, timing.rise[k], timing.fall[k]);
      }
      s = switched_inputs<M, Scalar>(problem.modes, in_effect);
    }
    const auto j = static_cast<std::size_t>(first + i);
    predict_step<M, dynamics, Scalar>(problem, j, s, planned, x, running);
    step(j, std::as_const(x));
  }
}

/// The relaxed problem's cost at any point, by simulation from problem.initial. The terms are those of problem.hpp, in
/// the same order, with relaxed_switch_change for the switch changes. Bounds on states and minimum dwells are left
/// out, so the minimum over weights and inputs is at most the optimum of the mixed-integer problem.
///
/// shapes   weights: intervals x modes    continuous: intervals    outputs: empty or steps
template <HybridModel M, class Scalar, Dynamics dynamics = Dynamics::exact>
Scalar relaxed_cost(const Problem<M>& problem, const SwitchTiming& timing, const RelaxedGrid& grid,
                    std::span<const Scalar> weights,
                    std::span<const std::type_identity_t<Vector<Scalar, M::continuous_size>>> continuous,
                    std::span<std::type_identity_t<Vector<Scalar, M::output_size>>> outputs = {}) noexcept {
  const auto modes = static_cast<std::size_t>(problem.modes.size());
  const auto switches = static_cast<std::size_t>(problem.modes.switch_count());
  Vector<Scalar, M::state_size> x;
  for (std::size_t i = 0; i < M::state_size; ++i) x[i] = Scalar(problem.initial[i]);
  auto previous = pattern_states<Scalar>(problem.lines.commanded());
  Scalar cost(0.0);
  int first = 0;
  for (std::size_t k = 0; k < grid.size(); ++k) {
    const auto c = commanded_states<Scalar>(problem.modes, weights.subspan(k * modes, modes));
    if (problem.cost.switching != 0.0)
      for (std::size_t s = 0; s < switches; ++s)
        cost = cost + Scalar(problem.cost.switching) * relaxed_switch_change<Scalar>(Scalar(c[s] - previous[s]));
    roll_interval<M, dynamics, Scalar>(
        problem, timing, first, grid.intervals[k], previous, c, continuous[k], x,
        [&](std::size_t j, const auto& state) {
          const auto z = problem.model.template output<Scalar>(state);
          cost = rollout_detail::weighted_square<M, Scalar>(problem.cost.tracking, problem.reference[j], z, cost);
          if (!outputs.empty()) outputs[j] = z;
        },
        [&](const Scalar& term) { cost = cost + term; });
    previous = c;
    first += grid.intervals[k];
  }
  return rollout_detail::weighted_square<M, Scalar>(problem.cost.terminal, problem.reference.back(),
                                                    problem.model.template output<Scalar>(x), cost);
}

/// The cost of a relaxed plan; fills its predicted outputs if they are sized.
template <HybridModel M, Dynamics dynamics = Dynamics::exact>
double relaxed_cost(const Problem<M>& problem, const RelaxedGrid& grid, RelaxedPlan<M>& plan) noexcept {
  const SwitchTiming timing(problem.modes, problem.horizon.dt_s);
  return relaxed_cost<M, double, dynamics>(problem, timing, grid, std::span<const double>(plan.weights),
                                           plan.continuous, plan.outputs);
}

/// Solves one relaxed Problem after another of the same shape.
template <HybridModel M>
class RelaxedSolver {
 public:
  virtual ~RelaxedSolver() = default;

  /// Sizes everything for problems with this model type, mode set, horizon and grid. May allocate and throw:
  /// std::invalid_argument where check_grid does or the mode set is beyond the solver.
  virtual void prepare(const Problem<M>& problem, const RelaxedGrid& grid) = 0;

  /// Improves on `plan`, which comes in as the warm start (by relax_plan, also an integer one) and leaves as the best
  /// plan found by the deadline, its outputs filled. report.cost is relaxed_cost of it by the exact dynamics, never
  /// above that of the warm start. report.bound says nothing (minus infinity): the problem is not convex, what is
  /// optimal is so among its neighbours. No allocation, lock or exception.
  virtual SolveReport solve(const Problem<M>& problem, RelaxedPlan<M>& plan, Deadline deadline) noexcept = 0;

  /// As Solver::anticipates().
  virtual bool anticipates() const { return false; }
  /// As Solver::anticipate().
  virtual void anticipate(const Problem<M>& /*expected*/, const RelaxedPlan<M>& /*warm_start*/) noexcept {}
  /// As Solver::time_phases().
  virtual bool time_phases(PhaseTimes* /*into*/) noexcept { return false; }
};

/// Throws std::invalid_argument unless the grid covers the horizon with intervals no shorter than the longest delay:
/// then every edge has taken effect by the end of its interval.
template <HybridModel M>
void check_grid(const Problem<M>& problem, const RelaxedGrid& grid) {
  const SwitchTiming timing(problem.modes, problem.horizon.dt_s);
  int steps = 0;
  for (const int length : grid.intervals) {
    if (length < std::max(1, timing.longest_delay))
      throw std::invalid_argument("relaxed grid: an interval is shorter than a step or the longest switch delay");
    steps += length;
  }
  if (steps != problem.horizon.steps())
    throw std::invalid_argument("relaxed grid: its intervals do not add up to the horizon");
}

}  // namespace solenoid
