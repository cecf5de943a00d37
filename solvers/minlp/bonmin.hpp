#pragma once

#include "core/mpc/solver.hpp"
#include "solvers/minlp/relaxed_gradient.hpp"

#include <vector>

namespace solenoid {

namespace minlp {

/// A function of one-of-`modes` choices in each of `intervals` intervals and of continuous variables in a box.
struct Function {
  virtual ~Function() = default;
  /// At x = (weights, interval-major; continuous); fills the gradient. No exception.
  virtual double operator()(std::span<const double> x, std::span<double> gradient) = 0;

  int intervals = 0, modes = 0;
  std::vector<double> lower, upper;  ///< of the continuous variables
};

/// How Bonmin goes about it.
enum class Algorithm : std::uint8_t {
  branch_and_bound,     ///< B-BB: a nonlinear relaxation a node
  outer_approximation,  ///< B-OA: mixed-integer linear problems of ever more tangents, which cut off what is not convex
  feasibility_pump,     ///< B-iFP: rounded and relaxed points that approach each other, again below each incumbent
};

/// What Bonmin found by the time it ended or was stopped.
struct Answer {
  bool found = false;    ///< x is a point with integral choices
  bool ended = false;    ///< the tree was searched to its end
  bool overran = false;  ///< it had to be killed
  std::vector<double> x;
  int nodes = 0;
};

/// Minimises by Bonmin from `start`, at most `seconds` (and one more before it is killed). Bonmin runs in a
/// process of its own: an assertion in it is a failure here, and two Ipopts never meet. Throws std::runtime_error where
/// that process fails or Bonmin is not built in.
Answer minimise(Function& function, const std::vector<double>& start, double seconds, Algorithm algorithm);

/// Whether this build has Bonmin (apt-get install coinor-libbonmin-dev, then build afresh).
bool available();

}  // namespace minlp

/// The mixed-integer problem by Bonmin [Bonami et al. 2008]: an outside opinion, offline.
///
/// minimise  relaxed_cost(weights, u) over one-of-modes weights a block, u in its box               [theory.md, eq. 1]
/// status    feasible: Bonmin ended with a plan. It proves nothing: the relaxation is not convex, and its nodes' local
///           solutions are no bounds    deadline_reached: stopped before    iteration_limit: ended without a plan
///           numerical_failure: Bonmin failed
///           The plan is never worse than the warm start, by evaluate().
/// bound     0: all terms of the cost are >= 0
template <HybridModel M>
class BonminSolver final : public Solver<M> {
 public:
  explicit BonminSolver(minlp::Algorithm algorithm = minlp::Algorithm::branch_and_bound) : algorithm_(algorithm) {}

  void prepare(const Problem<M>& problem) override {
    if (!problem.modes.one_at_a_time().empty())
      throw std::invalid_argument("bonmin: mode set '" + problem.modes.name() +
                                  "' has switches of which one may change at a time, which its equations do not say");
    if (!minlp::available())
      throw std::runtime_error("solver 'bonmin' is not built in: apt-get install coinor-libbonmin-dev, build afresh");
    grid_ = control_grid(problem.horizon, 0);
    check_grid(problem, grid_);
  }

  SolveReport solve(const Problem<M>& problem, Plan<M>& plan, Deadline deadline) noexcept override {
    const auto start = Deadline::Clock::now();
    Plan<M> found = plan;
    const SolveReport before = evaluate(problem, plan);
    SolveReport report = before;
    try {
      const Status status = search(problem, found, deadline, report.nodes);
      const SolveReport after = evaluate(problem, found);
      if (after.cost < before.cost) {
        plan.modes = found.modes;
        plan.continuous = found.continuous;
        report.cost = after.cost;
        report.switches = after.switches;
      }
      report.status = std::isfinite(report.cost) ? status : after.status;
    } catch (...) {
      report.status = Status::numerical_failure;
    }
    report.bound = 0.0;
    report.time_us = us_since(start);
    return report;
  }

 private:
  class Cost final : public minlp::Function {
   public:
    Cost(const Problem<M>& problem, const RelaxedGrid& grid, double scale) : problem_(problem), scale_(scale) {
      gradient_.prepare(problem, grid);
      intervals = static_cast<int>(grid.size());
      modes = problem.modes.size();
      u_.resize(grid.size());
      d_u_.resize(grid.size());
      for (std::size_t k = 0; k < grid.size(); ++k)
        for (std::size_t i = 0; i < M::continuous_size; ++i) {
          lower.push_back(problem.bounds.continuous_lower[i]);
          upper.push_back(problem.bounds.continuous_upper[i]);
        }
    }
    double operator()(std::span<const double> x, std::span<double> gradient) override {
      const std::size_t weights = u_.size() * static_cast<std::size_t>(modes);
      std::size_t at = weights;
      for (ContinuousOf<M>& u : u_)
        for (double& value : u) value = x[at++];
      const double cost = gradient_(problem_, x.first(weights), u_, gradient.first(weights), d_u_);
      at = weights;
      for (const ContinuousOf<M>& d : d_u_)
        for (const double value : d) gradient[at++] = value;
      for (double& g : gradient) g *= scale_;
      return scale_ * cost;
    }

   private:
    const Problem<M>& problem_;
    double scale_;
    RelaxedGradient<M, Dynamics::smoothed> gradient_;
    std::vector<ContinuousOf<M>> u_, d_u_;
  };

  Status search(const Problem<M>& problem, Plan<M>& plan, Deadline deadline, std::int64_t& nodes) {
    const double scale_by = evaluate(problem, plan).cost;
    Cost cost(problem, grid_, scale_by > 0.0 && std::isfinite(scale_by) ? 1.0 / scale_by : 1.0);
    RelaxedPlan<M> start(problem, grid_);
    relax_plan(problem, grid_, plan, start);
    std::vector<double> x = start.weights;
    for (const ContinuousOf<M>& u : start.continuous) x.insert(x.end(), u.begin(), u.end());
    const minlp::Answer answer = minlp::minimise(cost, x, deadline.seconds_left(), algorithm_);
    nodes = answer.nodes;
    if (answer.found) read(problem, answer.x, plan);
    if (!answer.ended) return Status::deadline_reached;
    return answer.found ? Status::feasible : Status::iteration_limit;
  }

  void read(const Problem<M>& problem, const std::vector<double>& x, Plan<M>& plan) const {
    const auto modes = static_cast<std::size_t>(problem.modes.size());
    std::size_t at = plan.modes.size() * modes;
    for (std::size_t k = 0; k < plan.modes.size(); ++k) {
      const auto row = std::span(x).subspan(k * modes, modes);
      plan.modes[k] = static_cast<int>(std::max_element(row.begin(), row.end()) - row.begin());
      for (double& value : plan.continuous[k]) value = x[at++];
    }
  }

  minlp::Algorithm algorithm_;
  RelaxedGrid grid_;
};

}  // namespace solenoid
