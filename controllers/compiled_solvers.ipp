#pragma once

#include "controllers/compiled_solvers.hpp"
#include "core/metrics/metrics.hpp"
#include "core/mpc/rollout.hpp"
#include "solvers/minlp/bonmin.hpp"
#include "solvers/sampling/mode_sampling.hpp"
#include "solvers/search/branch_and_bound.hpp"

#include <limits>
#include <stdexcept>

namespace solenoid {

/// In the one file that compiles a model's solvers, beside SOLENOID_COMPILE_SQP and _IPOPT (compiled_relaxed.ipp).
#define SOLENOID_COMPILE_SOLVERS(Model)                                                                           \
  template SolverPtr<Model> make_tree_search<Model>(bool);                                                        \
  template SolverPtr<Model> make_rounding<Model>(const ProjectedGradientSettings&, const RelaxAndRoundSettings&); \
  template RelaxedPtr<Model> make_projected_gradient<Model>(const ProjectedGradientSettings&);                    \
  template SolverPtr<Model> make_sampling<Model>(const ModeSamplingSettings&);                                    \
  template SolverPtr<Model> make_bonmin<Model>(const std::string&);                                               \
  template const ModelTools& model_tools<Model>();

template <HybridModel M>
SolverPtr<M> make_tree_search(bool prune) {
  return std::make_unique<BranchAndBound<M>>(TreeSearchSettings{.prune = prune});
}

template <HybridModel M>
SolverPtr<M> make_rounding(const ProjectedGradientSettings& relaxation, const RelaxAndRoundSettings& rounding) {
  return std::make_unique<RelaxAndRound<M>>(make_projected_gradient<M>(relaxation), rounding);
}

template <HybridModel M>
RelaxedPtr<M> make_projected_gradient(const ProjectedGradientSettings& settings) {
  return std::make_unique<ProjectedGradient<M>>(settings);
}

template <HybridModel M>
SolverPtr<M> make_sampling(const ModeSamplingSettings& settings) {
  return std::make_unique<ModeSampling<M>>(settings);
}

template <HybridModel M>
SolverPtr<M> make_bonmin(const std::string& algorithm) {
  using enum minlp::Algorithm;
  return std::make_unique<BonminSolver<M>>(algorithm == "outer_approximation" ? outer_approximation
                                           : algorithm == "feasibility_pump"  ? feasibility_pump
                                                                              : branch_and_bound);
}

/// What model_tools() is made of.
namespace detail {

/// See RelaxedBound.
template <HybridModel M>
class RelaxedBoundOf final : public RelaxedBound {
 public:
  explicit RelaxedBoundOf(const Problem<M>& shape)
      : grid_(control_grid(shape.horizon, 0)), relaxed_(shape, grid_), certifying_(certifier(shape, grid_)) {
    relaxing_->prepare(shape, grid_);
  }

  SolveReport solve(const AnyProblem& any, const AnyPlan& start) override {
    const auto begin = Deadline::Clock::now();
    const auto& problem = dynamic_cast<const Problem<M>&>(any);
    relax_plan(problem, grid_, dynamic_cast<const Plan<M>&>(start), relaxed_);
    SolveReport report = relaxing_->solve(problem, relaxed_, Deadline::never());
    for (double before = Bounds<M>::infinity; certifying_ && report.cost < before * (1.0 - 1e-9);) {
      before = report.cost;
      report = certifying_->solve(problem, relaxed_, Deadline::never());
      if (report.status == Status::optimal) break;
    }
    report.time_us = us_since(begin);
    return report;
  }

 private:
  /// Prepared; none for a model or mode set that the SQP is not compiled for.
  static RelaxedPtr<M> certifier(const Problem<M>& shape, const RelaxedGrid& grid) {
    RelaxedPtr<M> sqp = make_relaxed_sqp<M>();
    try {
      if (sqp) sqp->prepare(shape, grid);
    } catch (const std::invalid_argument&) {
      return nullptr;
    }
    return sqp;
  }

  RelaxedGrid grid_;
  RelaxedPlan<M> relaxed_;
  RelaxedPtr<M> relaxing_ = make_projected_gradient<M>({.most_iterations = 300, .tolerance = 1e-6});
  RelaxedPtr<M> certifying_;
};

/// See ModelTools.
template <HybridModel M>
class ModelToolsOf final : public ModelTools {
 public:
  SolveReport evaluate(const AnyProblem& problem, AnyPlan& plan) const noexcept override {
    return solenoid::evaluate(static_cast<const Problem<M>&>(problem), static_cast<Plan<M>&>(plan));
  }
  AnySolverPtr rounding(const ProjectedGradientSettings& relaxation,
                        const RelaxAndRoundSettings& rounding) const override {
    return make_rounding<M>(relaxation, rounding);
  }
  std::unique_ptr<RelaxedBound> relaxed_bound(const AnyProblem& shape) const override {
    return std::make_unique<RelaxedBoundOf<M>>(dynamic_cast<const Problem<M>&>(shape));
  }
};

}  // namespace detail

template <HybridModel M>
const ModelTools& model_tools() {
  static const detail::ModelToolsOf<M> tools;
  return tools;
}

}  // namespace solenoid
