#pragma once

#include "core/mpc/relaxation.hpp"
#include "solvers/relaxed/mode_hull.hpp"

#include <array>
#include <vector>

#include <Eigen/Core>

namespace solenoid {

/// What the intervals remember of v: switch states too where delays or a switching cost need the ones before.
template <HybridModel M>
Eigen::MatrixXd memory_rows(const Problem<M>& problem, const ModeHull& hull) {
  const bool switches =
      SwitchTiming(problem.modes, problem.horizon.dt_s).longest_delay > 0 || problem.cost.switching != 0.0;
  return switches ? hull.independent_rows() : hull.sums;
}

/// P and A of the transcription that a problem needs.
template <HybridModel M>
std::array<int, 2> transcription_sizes(const Problem<M>& problem) {
  const ModeHull hull(problem.modes);
  return {hull.weights(), static_cast<int>(memory_rows(problem, hull).rows())};
}

/// Direct multiple shooting of the relaxed problem: one stage an interval, with       [theory-relaxed.md, section 3]
///
///     stage state   (x, a)   x: the model's state at the interval's begin    a = memory v of the interval before
///     stage input   (v, u)   v: weights of ModeHull    u: continuous input
///
/// Only what couples intervals is remembered: the commanded switch states, where delays or a switching cost need the
/// ones before, and the group sums, whose bound a <= 1 thus becomes a bound of the next stage's state.
///
/// P: weights, A: rows of memory; compile-time, so that derivatives and factorisations have fixed size.
template <HybridModel M, int P, int A>
class Transcription {
 public:
  static constexpr int NX = static_cast<int>(M::state_size), NU = static_cast<int>(M::continuous_size);
  static constexpr int X = NX + A, U = P + NU, V = X + U;
  template <class S>
  using State = Vector<S, M::state_size>;
  using Input = Eigen::Matrix<double, U, 1>;
  using Memory = Eigen::Matrix<double, A, 1>;

  void prepare(const Problem<M>& problem, const RelaxedGrid& intervals) {
    check_grid(problem, intervals);
    grid = intervals;
    timing = SwitchTiming(problem.modes, problem.horizon.dt_s);
    hull = ModeHull(problem.modes);
    const Eigen::MatrixXd rows = memory_rows(problem, hull);
    if (hull.weights() != P || rows.rows() != A)
      throw std::invalid_argument("relaxed transcription: mode set '" + problem.modes.name() + "' has another size");
    memory = rows;
    sums = static_cast<int>(hull.sums.rows());
    first_step.assign(1, 0);
    for (const int length : grid.intervals) first_step.push_back(first_step.back() + length);
    recall_.setZero(hull.offset.size(), A);
    if (A > sums) recall_ = hull.recall(rows);
    scale.fill(1.0);
    if constexpr (HasStateScale<M>) scale = problem.model.state_scale();
    for (std::size_t i = 0; i < M::switched_size; ++i)
      for (int p = 0; p < P; ++p) {
        switched_gain(static_cast<Eigen::Index>(i), p) = 0.0;
        for (int c = 0; c < problem.modes.switch_count(); ++c)
          switched_gain(static_cast<Eigen::Index>(i), p) +=
              (problem.modes.point(SwitchPattern{1} << c)[i] - problem.modes.point(0)[i]) * hull.gain(c, p);
      }
  }

  std::size_t stages() const { return grid.size(); }

  /// Commanded switch states of v.
  template <class S, class Weights>
  SwitchStates<S> commanded(const Weights& v) const noexcept {
    SwitchStates<S> c;
    c.fill(S(0.0));
    for (Eigen::Index k = 0; k < hull.offset.size(); ++k) {
      S sum(hull.offset[k]);
      for (int p = 0; p < P; ++p)
        if (const double gain = hull.gain(k, p); gain != 0.0) sum = sum + S(gain) * v[p];
      c[static_cast<std::size_t>(k)] = sum;
    }
    return c;
  }
  /// Switch states commanded in the interval before, of the memory; in the first interval the command in force.
  template <class S, class Remembered>
  SwitchStates<S> previous(const Problem<M>& problem, std::size_t k, const Remembered& a) const noexcept {
    if (k == 0) return pattern_states<S>(problem.lines.commanded());
    SwitchStates<S> c;
    c.fill(S(0.0));
    for (Eigen::Index i = 0; i < hull.offset.size(); ++i) {
      S sum(hull.offset[i]);
      for (int j = 0; j < A; ++j)
        if (const double gain = recall_(i, j); gain != 0.0) sum = sum + S(gain) * a[static_cast<std::size_t>(j)];
      c[static_cast<std::size_t>(i)] = sum;
    }
    return c;
  }

  /// Stage inputs of a relaxed plan, and back.
  void from_plan(const Problem<M>& problem, const RelaxedPlan<M>& plan, std::size_t k, Input& w) const noexcept {
    std::array<double, P + 1> v{};
    hull.marginals(plan.row(k), v.data());
    for (int p = 0; p < P; ++p) w[p] = std::clamp(v[static_cast<std::size_t>(p)], 0.0, 1.0);
    for (int i = 0; i < NU; ++i) {
      const auto at = static_cast<std::size_t>(i);
      w[P + i] =
          std::clamp(plan.continuous[k][at], problem.bounds.continuous_lower[at], problem.bounds.continuous_upper[at]);
    }
  }
  void to_plan(const Input& w, std::size_t k, RelaxedPlan<M>& plan) const noexcept {
    std::array<double, P + 1> v{};
    for (int p = 0; p < P; ++p) v[static_cast<std::size_t>(p)] = w[p];
    hull.mode_weights(v.data(), plan.row(k));
    for (int i = 0; i < NU; ++i) plan.continuous[k][static_cast<std::size_t>(i)] = w[P + i];
  }

  /// The memory after stage input w.
  Memory remember(const Input& w) const noexcept { return memory * w.template head<P>(); }

  /// d(c_k - c_{k-1})/d(a, v) of one switch; in the first interval the memory is a constant.
  Eigen::Matrix<double, A + P, 1> change_gain(std::size_t k, Eigen::Index c) const noexcept {
    Eigen::Matrix<double, A + P, 1> row;
    for (int j = 0; j < A; ++j) row[j] = k == 0 ? 0.0 : -recall_(c, j);
    for (int p = 0; p < P; ++p) row[A + p] = hull.gain(c, p);
    return row;
  }

  /// The switching cost of stage k in the switch states' changes.
  template <class S>
  S switching_cost(const Problem<M>& problem, const SwitchStates<S>& before, const SwitchStates<S>& c) const noexcept {
    S sum(0.0);
    for (std::size_t i = 0; i < static_cast<std::size_t>(timing.switches); ++i)
      sum = sum + S(problem.cost.switching) * relaxed_switch_change<S>(S(c[i] - before[i]));
    return sum;
  }

  RelaxedGrid grid;
  SwitchTiming timing;
  ModeHull hull;
  std::vector<int> first_step;
  int sums = 0;  ///< of the rows of memory, the first
  State<double> scale;
  Eigen::Matrix<double, A, P> memory;
  Eigen::Matrix<double, static_cast<int>(M::switched_size), P> switched_gain;  ///< ds/dv once delays are over

 private:
  Eigen::Matrix<double, Eigen::Dynamic, A> recall_;  // previous switch states = offset + recall a
};

}  // namespace solenoid
