#pragma once

#include "core/mpc/relaxation.hpp"
#include "solvers/relaxed/dual.hpp"

#include <Eigen/Core>

namespace solenoid {

/// The relaxed problem as a function of its inputs alone, the states eliminated by simulation (single shooting): value
/// and gradient for general-purpose NLP and MINLP solvers. Each interval is differentiated forwards in its own few
/// arguments and the intervals are chained backwards, so that a gradient costs a fixed number of rollouts.
///
/// shapes   weights, d_weights: intervals x modes    continuous, d_continuous: intervals
template <HybridModel M, Dynamics dynamics = Dynamics::exact>
class RelaxedGradient {
 public:
  void prepare(const Problem<M>& problem, const RelaxedGrid& grid) {
    timing_ = SwitchTiming(problem.modes, problem.horizon.dt_s);
    grid_ = grid;
    parts_.resize(grid.size());
  }

  double operator()(const Problem<M>& problem, std::span<const double> weights,
                    std::span<const ContinuousOf<M>> continuous, std::span<double> d_weights,
                    std::span<ContinuousOf<M>> d_continuous) noexcept {
    const auto modes = static_cast<std::size_t>(problem.modes.size());
    auto previous = pattern_states<double>(problem.lines.commanded());
    StateOf<M> x = problem.initial;
    double cost = 0.0;
    int first = 0;
    for (std::size_t k = 0; k < grid_.size(); ++k) {
      const auto c = commanded_states<double>(problem.modes, weights.subspan(k * modes, modes));
      const Interval interval{first, k, previous, c, continuous[k], x};
      if (problem.modes.switch_count() <= few)
        with_best_lanes([&](auto lanes) { cost += roll<few, lanes>(problem, interval, 0, x); });
      else
        cost += roll_in_passes(problem, interval, x);
      previous = c;
      first += grid_.intervals[k];
    }
    chain(problem, d_weights, d_continuous);
    return cost;
  }

 private:
  static constexpr int nx = M::state_size, ns = max_switches, nu = M::continuous_size, size = nx + 2 * ns + nu;
  using Gradient = Eigen::Matrix<double, size, 1>;  // by state, previous command, command, continuous input
  static constexpr int few = 4;                     // switches: duals of the width that most mode sets need
  static constexpr int at_once = 8;                 // of more, those that one pass is differentiated by
  struct Part {
    Gradient cost;
    Eigen::Matrix<double, nx, size> end;  // of the state at the interval's end
  };

  struct Interval {
    int first;  // step of the horizon
    std::size_t k;
    SwitchStates<double> previous, command;
    ContinuousOf<M> planned;
    StateOf<M> state;  // as it begins
  };

  /// Rolls an interval as often as it takes to differentiate by all switches.
  double roll_in_passes(const Problem<M>& problem, const Interval& interval, StateOf<M>& end) noexcept {
    double cost = 0.0;
    for (int from = 0; from < problem.modes.switch_count(); from += at_once)
      cost = roll<at_once, 2>(problem, interval, from, end);
    return cost;
  }

  /// Rolls an interval, keeps its derivatives by the switches from `from` on and by all else, and returns its cost; the
  /// last one's has the terminal cost.
  template <int seeded, int lanes>
  double roll(const Problem<M>& problem, const Interval& interval, int from, StateOf<M>& end) noexcept {
    using Number = Dual<nx + 2 * seeded + nu, lanes>;
    const auto seed = static_cast<std::size_t>(from);
    const std::size_t k = interval.k;
    Vector<Number, M::state_size> x;
    SwitchStates<Number> before, c;
    for (std::size_t i = 0; i < max_switches; ++i) {
      before[i] = Number(interval.previous[i]);
      c[i] = Number(interval.command[i]);
    }
    Vector<Number, M::continuous_size> u;
    int at = 0;
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = Number(interval.state[i], at++);
    for (std::size_t i = 0; i < seeded; ++i) before[seed + i] = Number(interval.previous[seed + i], at++);
    for (std::size_t i = 0; i < seeded; ++i) c[seed + i] = Number(interval.command[seed + i], at++);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] = Number(interval.planned[i], at++);
    Number cost(0.0);
    if (problem.cost.switching != 0.0)
      for (std::size_t i = 0; i < static_cast<std::size_t>(problem.modes.switch_count()); ++i)
        cost = cost + Number(problem.cost.switching) * relaxed_switch_change<Number>(Number(c[i] - before[i]));
    roll_interval<M, dynamics, Number>(
        problem, timing_, interval.first, grid_.intervals[k], before, c, u, x,
        [&](std::size_t j, const auto& now) {
          cost = rollout_detail::weighted_square<M, Number>(problem.cost.tracking, problem.reference[j],
                                                            problem.model.template output<Number>(now), cost);
        },
        [&](const Number& term) { cost = cost + term; });
    if (k + 1 == grid_.size())
      cost = rollout_detail::weighted_square<M, Number>(problem.cost.terminal, problem.reference.back(),
                                                        problem.model.template output<Number>(x), cost);
    Part& part = parts_[k];
    if (from == 0) part.cost.setZero(), part.end.setZero();
    spread<seeded, lanes>(cost, from, part.cost);
    for (std::size_t i = 0; i < x.size(); ++i) {
      spread<seeded, lanes>(x[i], from, part.end.row(static_cast<int>(i)).transpose());
      end[i] = x[i].value();
    }
    return cost.value();
  }

  /// Derivatives by `seeded` switches from `from` on at their places among all.
  template <int seeded, int lanes, class Row>
  static void spread(const Dual<nx + 2 * seeded + nu, lanes>& number, int from, Row&& all) noexcept {
    Eigen::Matrix<double, Dual<nx + 2 * seeded + nu, lanes>::size, 1> d;
    number.copy_derivatives(d.data());
    all.template head<nx>() = d.template head<nx>();
    all.template segment<seeded>(nx + from) = d.template segment<seeded>(nx);
    all.template segment<seeded>(nx + ns + from) = d.template segment<seeded>(nx + seeded);
    all.template tail<nu>() = d.template segment<nu>(nx + 2 * seeded);
  }

  void chain(const Problem<M>& problem, std::span<double> d_weights, std::span<ContinuousOf<M>> d_continuous) noexcept {
    const auto modes = static_cast<std::size_t>(problem.modes.size());
    Eigen::Matrix<double, nx, 1> costate = Eigen::Matrix<double, nx, 1>::Zero();
    Eigen::Matrix<double, ns, 1> as_previous = Eigen::Matrix<double, ns, 1>::Zero();  // of the interval after
    for (std::size_t k = grid_.size(); k-- > 0;) {
      const Gradient total = parts_[k].cost + parts_[k].end.transpose() * costate;
      const Eigen::Matrix<double, ns, 1> command = total.template segment<ns>(nx + ns) + as_previous;
      for (std::size_t m = 0; m < modes; ++m) {
        double sum = 0.0;
        for (int c = 0; c < problem.modes.switch_count(); ++c)
          if ((problem.modes.pattern(static_cast<int>(m)) >> c) & 1u) sum += command[c];
        d_weights[k * modes + m] = sum;
      }
      for (std::size_t i = 0; i < M::continuous_size; ++i)
        d_continuous[k][i] = total[nx + 2 * ns + static_cast<int>(i)];
      costate = total.template head<nx>();
      as_previous = total.template segment<ns>(nx);
    }
  }

  SwitchTiming timing_;
  RelaxedGrid grid_;
  std::vector<Part> parts_;
};

}  // namespace solenoid
