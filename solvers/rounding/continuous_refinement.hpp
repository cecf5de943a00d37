#pragma once

#include "core/mpc/deadline.hpp"
#include "core/mpc/phases.hpp"
#include "core/mpc/rollout.hpp"
#include "solvers/relaxed/dual.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

namespace solenoid {

/// When ContinuousRefinement ends, and how carefully it steps.
struct ContinuousRefinementSettings {
  int most_iterations = 10;
  double tolerance = 1e-6;  ///< relative decrease of the cost, promised or found, below which it ends
  double damping = 1e-2;    ///< of the first step, relative to the largest curvature of an input
  int refusals = 6;         ///< steps damped eightfold in a row, before it ends
};

/// The continuous input of each block, best for the modes as they are: projected Gauss-Newton steps [Bertsekas 1982] on
/// the residuals of the cost over the box of problem.bounds, damped [Levenberg 1944], each accepted by the true cost.
///
///     minimise over u[b] in [continuous_lower, continuous_upper]  evaluate(plan).cost   [theory-rounding.md, sect. 5]
///
/// The switch states are fixed by the modes, so only u moves the prediction. Derivatives are exact on the branch of the
/// physics a state is on. An input that a saturated or resting motor does not feel has next to no curvature, and a step
/// across a kink costs more than it promises: the damping is for both.
/// promise   the cost never rises; u stays in its box; no allocation after prepare
template <HybridModel M>
class ContinuousRefinement {
 public:
  explicit ContinuousRefinement(const ContinuousRefinementSettings& settings = {}) : settings_(settings) {}

  void prepare(const Problem<M>& problem) {
    timing_ = SwitchTiming(problem.modes, problem.horizon.dt_s);
    const auto n = static_cast<Eigen::Index>(M::continuous_size * problem.horizon.blocks.size());
    hessian_.setZero(n, n);
    factor_.setZero(n, n);
    gradient_.setZero(n);
    step_.setZero(n);
    sensitivity_.setZero(nx, n);
    row_.setZero(n);
    free_.assign(static_cast<std::size_t>(n), 1);
    trial_ = Plan<M>(problem);
  }

  /// The report of evaluate() for the plan it leaves; its nodes are iterations. feasible: no further decrease;
  /// iteration_limit, deadline_reached: stopped; else the plan that came had no finite cost and is unchanged.
  SolveReport refine(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept {
    project(problem, plan);
    SolveReport report = rolled(problem, plan);
    if (report.status != Status::feasible || gradient_.size() == 0) return report;
    std::copy(plan.modes.begin(), plan.modes.end(), trial_.modes.begin());
    std::int64_t iterations = 0;
    damping_ = settings_.damping;
    for (;; ++iterations) {
      if (iterations == settings_.most_iterations) report.status = Status::iteration_limit;
      if (deadline.passed()) report.status = Status::deadline_reached;
      if (report.status != Status::feasible) break;
      differentiate(problem, plan);
      const double before = report.cost;
      if (!step_down(problem, plan, report)) break;
      if (before - report.cost <= settings_.tolerance * before) break;
    }
    report.nodes = iterations;
    return report;
  }

  void time_phases(PhaseTimes* into) noexcept { phases_ = into; }

 private:
  static_assert(M::continuous_size > 0);
  static constexpr int nx = M::state_size, nu = M::continuous_size;

  static void project(const Problem<M>& problem, Plan<M>& plan) noexcept {
    for (ContinuousOf<M>& u : plan.continuous)
      for (std::size_t i = 0; i < M::continuous_size; ++i)
        u[i] = std::min(std::max(u[i], problem.bounds.continuous_lower[i]), problem.bounds.continuous_upper[i]);
  }

  void differentiate(const Problem<M>& problem, const Plan<M>& plan) noexcept {
    const PhaseScope timed(phases_, Phase::derivatives);
    with_best_lanes([&](auto lanes) { linearise<lanes>(problem, plan); });
  }

  /// Half the gradient and half the Gauss-Newton Hessian of the cost in u, the sensitivities of the state carried along
  /// the rollout; those to later blocks are zero and left alone.
  template <int lanes>
  void linearise(const Problem<M>& problem, const Plan<M>& plan) noexcept {
    hessian_.setZero();
    gradient_.setZero();
    sensitivity_.setZero();
    DelayLines lines = problem.lines;
    StateOf<M> x = problem.initial;
    std::size_t j = 0;
    for (std::size_t b = 0; b < plan.modes.size(); ++b) {
      lines.command(problem.modes.pattern(plan.modes[b]), timing_);
      for (int i = 0; i < problem.horizon.blocks[b]; ++i, ++j) {
        SwitchedOf<M> switched;
        std::ranges::copy(problem.modes.point(lines.effective(i)), switched.begin());
        step_sensitivity<lanes>(problem, j, switched, plan.continuous[b], b, x);
        const bool last = j + 1 == problem.reference.size();
        add_residuals<lanes>(problem, j, last, reached(b), x);
      }
      lines.advance(problem.horizon.blocks[b]);
      for (std::size_t i = 0; i < M::continuous_size; ++i) {
        const auto at = static_cast<Eigen::Index>(b * M::continuous_size + i);
        hessian_(at, at) += problem.cost.continuous[i] * problem.horizon.blocks[b];
      }
    }
  }

  /// Inputs that have acted by the end of block b.
  static Eigen::Index reached(std::size_t b) noexcept {
    return static_cast<Eigen::Index>((b + 1) * M::continuous_size);
  }

  /// Step j with the gradient of its running cost; the squares among that are in the Hessian from linearise().
  template <int lanes>
  void step_sensitivity(const Problem<M>& problem, std::size_t j, const SwitchedOf<M>& switched,
                        const ContinuousOf<M>& planned, std::size_t b, StateOf<M>& x) noexcept {
    using StepDual = Dual<nx + nu, lanes>;
    Vector<StepDual, M::state_size> state;
    Vector<StepDual, M::switched_size> s;
    Vector<StepDual, M::continuous_size> u;
    for (std::size_t i = 0; i < M::state_size; ++i) state[i] = StepDual(x[i], static_cast<int>(i));
    for (std::size_t i = 0; i < M::switched_size; ++i) s[i] = StepDual(switched[i]);
    for (std::size_t i = 0; i < M::continuous_size; ++i) u[i] = StepDual(planned[i], nx + static_cast<int>(i));
    Eigen::Matrix<double, StepDual::size, 1> row;
    predict_step<M, Dynamics::exact, StepDual>(problem, j, s, u, state, [&](const StepDual& term) {
      term.copy_derivatives(row.data());
      for (Eigen::Index c = 0; c < reached(b); ++c)
        gradient_[c] += 0.5 * row.template head<nx>().dot(sensitivity_.col(c));
      gradient_.template segment<nu>(reached(b) - nu) += 0.5 * row.template segment<nu>(nx);
    });
    Eigen::Matrix<double, nx, nx + nu> jacobian;
    for (int i = 0; i < nx; ++i) {
      state[static_cast<std::size_t>(i)].copy_derivatives(row.data());
      jacobian.row(i) = row.template head<nx + nu>().transpose();
      x[static_cast<std::size_t>(i)] = state[static_cast<std::size_t>(i)].value();
    }
    for (Eigen::Index c = 0; c < reached(b); ++c) {
      const Eigen::Matrix<double, nx, 1> before = sensitivity_.col(c);
      sensitivity_.col(c).noalias() = jacobian.template leftCols<nx>() * before;
    }
    sensitivity_.template middleCols<nu>(reached(b) - nu) += jacobian.template rightCols<nu>();
  }

  template <int lanes>
  void add_residuals(const Problem<M>& problem, std::size_t j, bool last, Eigen::Index count,
                     const StateOf<M>& x) noexcept {
    Vector<Dual<nx, lanes>, M::state_size> state;
    for (std::size_t i = 0; i < M::state_size; ++i) state[i] = Dual<nx, lanes>(x[i], static_cast<int>(i));
    const auto output = problem.model.template output<Dual<nx, lanes>>(state);
    for (std::size_t z = 0; z < M::output_size; ++z) {
      const double weight = problem.cost.tracking[z] + (last ? problem.cost.terminal[z] : 0.0);
      if (weight == 0.0) continue;
      Eigen::Matrix<double, Dual<nx, lanes>::size, 1> d;
      output[z].copy_derivatives(d.data());
      const double pull = weight * (output[z].value() - problem.reference[j][z]);
      for (Eigen::Index i = 0; i < count; ++i) {
        row_[i] = d.template head<nx>().dot(sensitivity_.col(i));
        gradient_[i] += pull * row_[i];
      }
      for (Eigen::Index k = 0; k < count; ++k)
        for (Eigen::Index i = k; i < count; ++i) hessian_(i, k) += weight * row_[k] * row_[i];
    }
  }

  /// The Gauss-Newton step over the inputs that are not held at a bound by the gradient.
  /// Returns a lower bound of the decrease of the cost that the squares promise for it.
  double find_step(const Problem<M>& problem, const Plan<M>& plan) noexcept {
    const Eigen::Index n = gradient_.size();
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto b = static_cast<std::size_t>(i) / M::continuous_size,
                 k = static_cast<std::size_t>(i) % M::continuous_size;
      const double u = plan.continuous[b][k];
      const bool held = (u <= problem.bounds.continuous_lower[k] && gradient_[i] > 0.0) ||
                        (u >= problem.bounds.continuous_upper[k] && gradient_[i] < 0.0);
      free_[static_cast<std::size_t>(i)] = !held;
    }
    const double regular = damping_ * hessian_.diagonal().maxCoeff() + 1e-300;
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index k = 0; k <= i; ++k) {
        const bool both = free_[static_cast<std::size_t>(i)] && free_[static_cast<std::size_t>(k)];
        factor_(i, k) = i == k ? (both ? hessian_(i, i) + regular : 1.0) : (both ? hessian_(i, k) : 0.0);
      }
    for (Eigen::Index i = 0; i < n; ++i) step_[i] = free_[static_cast<std::size_t>(i)] ? -gradient_[i] : 0.0;
    cholesky_solve();
    return -gradient_.dot(step_);
  }

  /// step_ <- factor_^-1 step_, factor_ overwritten by its Cholesky factor.
  void cholesky_solve() noexcept {
    const Eigen::Index n = step_.size();
    for (Eigen::Index j = 0; j < n; ++j) {
      const double pivot = factor_(j, j) - factor_.row(j).head(j).squaredNorm();
      factor_(j, j) = std::sqrt(std::max(pivot, 1e-300));
      for (Eigen::Index i = j + 1; i < n; ++i)
        factor_(i, j) = (factor_(i, j) - factor_.row(i).head(j).dot(factor_.row(j).head(j))) / factor_(j, j);
    }
    factor_.template triangularView<Eigen::Lower>().solveInPlace(step_);
    factor_.template triangularView<Eigen::Lower>().transpose().solveInPlace(step_);
  }

  /// Damps the step until the projected point costs less; false if none does that promises anything.
  bool step_down(const Problem<M>& problem, Plan<M>& plan, SolveReport& report) noexcept {
    for (int refusal = 0; refusal <= settings_.refusals; ++refusal, damping_ *= 8.0) {
      const double promised = find_step(problem, plan);
      if (promised <= settings_.tolerance * report.cost) return false;
      for (std::size_t b = 0; b < plan.modes.size(); ++b)
        for (std::size_t i = 0; i < M::continuous_size; ++i)
          trial_.continuous[b][i] =
              plan.continuous[b][i] + step_[static_cast<Eigen::Index>(b * M::continuous_size + i)];
      project(problem, trial_);
      const SolveReport trial = rolled(problem, trial_);
      if (trial.status != Status::feasible || !(trial.cost < report.cost)) continue;
      std::copy(trial_.continuous.begin(), trial_.continuous.end(), plan.continuous.begin());
      if (report.cost - trial.cost > 0.5 * promised) damping_ *= 0.2;
      report = trial;
      return true;
    }
    return false;
  }

  SolveReport rolled(const Problem<M>& problem, Plan<M>& plan) noexcept {
    const PhaseScope timed(phases_, Phase::rollout);
    return evaluate(problem, plan);
  }

  ContinuousRefinementSettings settings_;
  PhaseTimes* phases_ = nullptr;
  double damping_ = 0.0;
  SwitchTiming timing_;
  Eigen::MatrixXd hessian_, factor_;  // lower triangles
  Eigen::VectorXd gradient_, step_;
  Eigen::Matrix<double, nx, Eigen::Dynamic> sensitivity_;  // d state / d u
  Eigen::VectorXd row_;
  std::vector<char> free_;
  Plan<M> trial_;
};

}  // namespace solenoid
