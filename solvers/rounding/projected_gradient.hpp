#pragma once

#include "core/mpc/flatten.hpp"
#include "core/mpc/phases.hpp"
#include "solvers/minlp/relaxed_gradient.hpp"

#include <array>

namespace solenoid {

/// Euclidean projection onto {a >= 0, sum a = 1}, in place (Held, Wolfe, Crowder 1974). scratch: as long as a.
inline void project_onto_simplex(std::span<double> a, std::span<double> scratch) noexcept {
  for (std::size_t i = 0; i < a.size(); ++i) {  // insertion: rows are short
    std::size_t at = i;
    for (; at > 0 && scratch[at - 1] < a[i]; --at) scratch[at] = scratch[at - 1];
    scratch[at] = a[i];
  }
  double sum = 0.0, shift = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += scratch[i];
    const double candidate = (sum - 1.0) / static_cast<double>(i + 1);
    if (scratch[i] > candidate) shift = candidate;
  }
  for (double& value : a) value = std::max(value - shift, 0.0);
}

/// When ProjectedGradient ends.
struct ProjectedGradientSettings {
  int most_iterations = 200;
  double tolerance = 1e-6;  ///< largest projected gradient step, per relative change of the cost
};

/// The relaxed problem by spectral projected gradients (Birgin, Martinez, Raydan 2000) over weights and continuous
/// inputs: no factorisation, so it takes grids of thousands of intervals, and shares nothing with second-order solvers
/// but the problem. Steps x + l (P(x - alpha g) - x), alpha by Barzilai and Borwein, l by a nonmonotone line search.
///
/// The continuous inputs take part where they have finite bounds, and are left as they came elsewhere.
/// status    optimal: stationary to the tolerance, among its neighbours
///           feasible: no step along the slope gains, at a kink of the physics
///           iteration_limit, deadline_reached: stopped
///           numerical_failure: the warm start has no finite cost
/// promise   the best point met is left, never worse than the warm start; no allocation in solve
template <HybridModel M>
class ProjectedGradient final : public RelaxedSolver<M> {
 public:
  explicit ProjectedGradient(const ProjectedGradientSettings& settings = {}) : settings_(settings) {}

  void prepare(const Problem<M>& problem, const RelaxedGrid& grid) override {
    check_grid(problem, grid);
    timing_ = SwitchTiming(problem.modes, problem.horizon.dt_s);
    grid_ = grid;
    gradient_.prepare(problem, grid);
    here_ = Point(problem, grid);
    next_ = step_ = best_ = here_;
    slope_ = next_slope_ = here_;
    sorted_.assign(static_cast<std::size_t>(problem.modes.size()), 0.0);
  }

  SolveReport solve(const Problem<M>& problem, RelaxedPlan<M>& plan, Deadline deadline) noexcept override {
    const auto start = Deadline::Clock::now();
    set_up(problem, plan);
    SolveReport report;
    report.cost = best_cost_;
    if (std::isfinite(best_cost_)) report.status = descend(problem, deadline, report.nodes);
    std::copy(best_.weights.begin(), best_.weights.end(), plan.weights.begin());
    std::copy(best_.continuous.begin(), best_.continuous.end(), plan.continuous.begin());
    report.cost = relaxed_cost(problem, grid_, plan);
    report.time_us = us_since(start);
    return report;
  }

  bool time_phases(PhaseTimes* into) noexcept override {
    phases_ = into;
    return true;
  }

 private:
  struct Point {
    std::vector<double> weights;
    std::vector<ContinuousOf<M>> continuous;
    Point() = default;
    Point(const Problem<M>& problem, const RelaxedGrid& grid)
        : weights(grid.size() * static_cast<std::size_t>(problem.modes.size())), continuous(grid.size()) {}
  };
  static constexpr std::size_t memory = 10;  // costs that the line search looks back on

  void set_up(const Problem<M>& problem, const RelaxedPlan<M>& plan) noexcept {
    std::copy(plan.weights.begin(), plan.weights.end(), here_.weights.begin());
    std::copy(plan.continuous.begin(), plan.continuous.end(), here_.continuous.begin());
    for (std::size_t i = 0; i < M::continuous_size; ++i) {
      const double width = problem.bounds.continuous_upper[i] - problem.bounds.continuous_lower[i];
      square_[i] = std::isfinite(width) ? 0.25 * width * width : 0.0;
    }
    copy(here_, best_);
    best_cost_ = cost_of(problem, here_);
  }

  static void copy(const Point& from, Point& to) noexcept {
    std::copy(from.weights.begin(), from.weights.end(), to.weights.begin());
    std::copy(from.continuous.begin(), from.continuous.end(), to.continuous.begin());
  }
  [[SOLENOID_FLATTEN]] double cost_of(const Problem<M>& problem, const Point& x) const noexcept {
    const PhaseScope timed(phases_, Phase::rollout);
    return relaxed_cost<M, double>(problem, timing_, grid_, std::span<const double>(x.weights), x.continuous);
  }
  double slope_at(const Problem<M>& problem, const Point& x, Point& slope) noexcept {
    const PhaseScope timed(phases_, Phase::derivatives);
    return gradient_(problem, x.weights, x.continuous, slope.weights, slope.continuous);
  }

  Status descend(const Problem<M>& problem, Deadline deadline, std::int64_t& iterations) noexcept {
    double cost = slope_at(problem, here_, slope_);
    std::array<double, memory> past;
    past.fill(cost);
    double alpha = 1.0 / std::max(largest(slope_), 1e-300);
    for (iterations = 0; iterations < settings_.most_iterations; ++iterations) {
      if (deadline.passed()) return Status::deadline_reached;
      const double decrease = -find_step(problem, alpha);
      if (!(decrease > settings_.tolerance * std::abs(cost))) return Status::optimal;
      if (!search_line(problem, *std::max_element(past.begin(), past.end()), decrease, cost)) return Status::feasible;
      past[static_cast<std::size_t>(iterations) % memory] = cost;
      alpha = accept(problem);
    }
    return Status::iteration_limit;
  }

  /// step_ = P(here - alpha slope) - here; returns its product with the slope, never positive.
  double find_step(const Problem<M>& problem, double alpha) noexcept {
    const std::size_t modes = sorted_.size();
    double product = 0.0;
    for (std::size_t k = 0; k < grid_.size(); ++k) {
      const auto row = std::span(step_.weights).subspan(k * modes, modes);
      for (std::size_t m = 0; m < modes; ++m)
        row[m] = here_.weights[k * modes + m] - alpha * slope_.weights[k * modes + m];
      project_onto_simplex(row, sorted_);
      for (std::size_t m = 0; m < modes; ++m) {
        row[m] -= here_.weights[k * modes + m];
        product += row[m] * slope_.weights[k * modes + m];
      }
      for (std::size_t i = 0; i < M::continuous_size; ++i) {
        const double u = here_.continuous[k][i];
        const double to = u - alpha * square_[i] * slope_.continuous[k][i];
        const bool free = square_[i] > 0.0;
        step_.continuous[k][i] =
            free ? std::clamp(to, problem.bounds.continuous_lower[i], problem.bounds.continuous_upper[i]) - u : 0.0;
        product += step_.continuous[k][i] * slope_.continuous[k][i];
      }
    }
    return product;
  }

  /// Shortens the step until the cost is below the highest of the past by a share of what the slope promises.
  bool search_line(const Problem<M>& problem, double highest, double decrease, double& cost) noexcept {
    double length = 1.0;
    for (int halving = 0; halving < 30; ++halving) {
      for (std::size_t i = 0; i < here_.weights.size(); ++i)
        next_.weights[i] = here_.weights[i] + length * step_.weights[i];
      for (std::size_t k = 0; k < grid_.size(); ++k)
        for (std::size_t i = 0; i < M::continuous_size; ++i)
          next_.continuous[k][i] = here_.continuous[k][i] + length * step_.continuous[k][i];
      const double there = cost_of(problem, next_);
      if (there < best_cost_) best_cost_ = there, copy(next_, best_);
      if (there <= highest - 1e-4 * length * decrease) {
        cost = there;
        return true;
      }
      const double parabola = 0.5 * length * length * decrease / (there - cost + length * decrease);
      length = std::isfinite(parabola) ? std::clamp(parabola, 0.1 * length, 0.5 * length) : 0.5 * length;
    }
    return false;
  }

  /// Moves on to next_; returns the Barzilai-Borwein length.
  double accept(const Problem<M>& problem) noexcept {
    slope_at(problem, next_, next_slope_);
    double moved = 0.0, bent = 0.0;
    for (std::size_t i = 0; i < here_.weights.size(); ++i) {
      const double s = next_.weights[i] - here_.weights[i];
      moved += s * s;
      bent += s * (next_slope_.weights[i] - slope_.weights[i]);
    }
    for (std::size_t k = 0; k < grid_.size(); ++k)
      for (std::size_t i = 0; i < M::continuous_size; ++i) {
        const double s = next_.continuous[k][i] - here_.continuous[k][i];
        moved += square_[i] > 0.0 ? s * s / square_[i] : 0.0;
        bent += s * (next_slope_.continuous[k][i] - slope_.continuous[k][i]);
      }
    copy(next_, here_);
    copy(next_slope_, slope_);
    const double unit = 1.0 / std::max(largest(slope_), 1e-300);
    return bent > 0.0 ? std::clamp(moved / bent, 1e-3 * unit, 1e6 * unit) : 1e2 * unit;
  }

  double largest(const Point& slope) const noexcept {
    double most = 0.0;
    for (const double g : slope.weights) most = std::max(most, std::abs(g));
    for (const ContinuousOf<M>& g : slope.continuous)
      for (std::size_t i = 0; i < M::continuous_size; ++i)
        most = std::max(most, std::abs(g[i]) * std::sqrt(square_[i]));
    return most;
  }

  ProjectedGradientSettings settings_;
  PhaseTimes* phases_ = nullptr;
  SwitchTiming timing_;
  RelaxedGrid grid_;
  RelaxedGradient<M> gradient_;
  Point here_, next_, step_, best_, slope_, next_slope_;
  double best_cost_ = 0.0;
  ContinuousOf<M> square_{};  // of half the width of each continuous input's bounds; 0 without
  std::vector<double> sorted_;
};

}  // namespace solenoid
