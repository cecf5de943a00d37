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
      if (problem.modes.switch_count() <= few)
        with_best_lanes(
            [&](auto lanes) { cost += roll<few, lanes>(problem, first, k, previous, c, continuous[k], x); });
      else
        cost += roll<ns, 2>(problem, first, k, previous, c, continuous[k], x);
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
  struct Part {
    Gradient cost;
    Eigen::Matrix<double, nx, size> end;  // of the state at the interval's end
  };

  /// Rolls interval k, keeps its derivatives and returns its cost; the last one's has the terminal cost.
  template <int seeded, int lanes>
  double roll(const Problem<M>& problem, int first, std::size_t k, const SwitchStates<double>& previous,
              const SwitchStates<double>& command, const ContinuousOf<M>& planned, StateOf<M>& state) noexcept {
    using Number = Dual<nx + 2 * seeded + nu, lanes>;
    Vector<Number, M::state_size> x;
    SwitchStates<Number> before, c;
    before.fill(Number(0.0));
    c.fill(Number(0.0));
    Vector<Number, M::continuous_size> u;
    int at = 0;
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = Number(state[i], at++);
    for (std::size_t i = 0; i < seeded; ++i) before[i] = Number(previous[i], at++);
    for (std::size_t i = 0; i < seeded; ++i) c[i] = Number(command[i], at++);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] = Number(planned[i], at++);
    Number cost(0.0);
    if (problem.cost.switching != 0.0)
      for (std::size_t i = 0; i < static_cast<std::size_t>(problem.modes.switch_count()); ++i)
        cost = cost + Number(problem.cost.switching) * relaxed_switch_change<Number>(Number(c[i] - before[i]));
    roll_interval<M, dynamics, Number>(
        problem, timing_, first, grid_.intervals[k], before, c, u, x,
        [&](std::size_t j, const auto& now) {
          cost = rollout_detail::weighted_square<M, Number>(problem.cost.tracking, problem.reference[j],
                                                            problem.model.template output<Number>(now), cost);
        },
        [&](const Number& term) { cost = cost + term; });
    if (k + 1 == grid_.size())
      cost = rollout_detail::weighted_square<M, Number>(problem.cost.terminal, problem.reference.back(),
                                                        problem.model.template output<Number>(x), cost);
    parts_[k].cost = spread<seeded, lanes>(cost);
    for (std::size_t i = 0; i < x.size(); ++i) {
      parts_[k].end.row(static_cast<int>(i)) = spread<seeded, lanes>(x[i]).transpose();
      state[i] = x[i].value();
    }
    return cost.value();
  }

  /// Derivatives by `seeded` switches at the places of all.
  template <int seeded, int lanes>
  static Gradient spread(const Dual<nx + 2 * seeded + nu, lanes>& number) noexcept {
    Eigen::Matrix<double, Dual<nx + 2 * seeded + nu, lanes>::size, 1> d;
    number.copy_derivatives(d.data());
    Gradient all = Gradient::Zero();
    all.template head<nx>() = d.template head<nx>();
    all.template segment<seeded>(nx) = d.template segment<seeded>(nx);
    all.template segment<seeded>(nx + ns) = d.template segment<seeded>(nx + seeded);
    all.template tail<nu>() = d.template segment<nu>(nx + 2 * seeded);
    return all;
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
        for (int c = 0; c < ns; ++c)
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
