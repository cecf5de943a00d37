#pragma once

#include "controllers/compiled_solvers.hpp"
#include "core/metrics/metrics.hpp"
#include "core/mpc/rollout.hpp"
#include "solvers/learned/judged_policy.hpp"
#include "solvers/learned/network_proposer.hpp"
#include "solvers/learned/tail_search.hpp"
#include "solvers/minlp/bonmin.hpp"
#include "solvers/sampling/mode_sampling.hpp"
#include "solvers/search/branch_and_bound.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

namespace solenoid {

/// In the one file that compiles a model's solvers, beside SOLENOID_COMPILE_SQP and _IPOPT (compiled_relaxed.ipp).
#define SOLENOID_COMPILE_SOLVERS(Model)                                                                           \
  template SolverPtr<Model> make_tree_search<Model>(bool, std::shared_ptr<const Mlp>);                            \
  template SolverPtr<Model> make_policy<Model>(std::shared_ptr<const Mlp>);                                       \
  template SolverPtr<Model> make_tail_search<Model>(std::shared_ptr<const Mlp>, int);                             \
  template SolverPtr<Model> make_rounding<Model>(const ProjectedGradientSettings&, const RelaxAndRoundSettings&); \
  template RelaxedPtr<Model> make_projected_gradient<Model>(const ProjectedGradientSettings&);                    \
  template SolverPtr<Model> make_sampling<Model>(const ModeSamplingSettings&);                                    \
  template SolverPtr<Model> make_bonmin<Model>(const std::string&);                                               \
  template const ModelTools& model_tools<Model>();

template <HybridModel M>
SolverPtr<M> make_tree_search(bool prune, std::shared_ptr<const Mlp> proposing) {
  std::unique_ptr<Proposer<M>> proposer;
  if (proposing) proposer = std::make_unique<NetworkProposer<M>>(std::move(proposing));
  return std::make_unique<BranchAndBound<M>>(TreeSearchSettings{.prune = prune}, rollout_kernel<M>(),
                                             std::move(proposer));
}

template <HybridModel M>
SolverPtr<M> make_policy(std::shared_ptr<const Mlp> network) {
  return std::make_unique<JudgedPolicy<M>>(std::make_unique<NetworkProposer<M>>(std::move(network)));
}

template <HybridModel M>
SolverPtr<M> make_tail_search(std::shared_ptr<const Mlp> network, int searched_blocks) {
  return std::make_unique<TailSearch<M>>(std::make_unique<NetworkTailCost<M>>(std::move(network)), searched_blocks);
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

/// See AnyFeatures.
template <HybridModel M>
class FeaturesOf final : public AnyFeatures {
 public:
  explicit FeaturesOf(const Problem<M>& shape) : weights_(weights_text(shape)) { features_.prepare(shape); }
  std::size_t size() const override { return features_.size(); }
  std::string layout() const override { return features_.layout(); }
  std::string cost_layout() const override { return features_.layout() + "; " + weights_; }
  void write(const AnyProblem& any, std::span<float> into) const noexcept override {
    const auto& problem = static_cast<const Problem<M>&>(any);
    features_.write(problem, problem.initial, problem.lines, into);
  }

 private:
  ProblemFeatures<M> features_;
  std::string weights_;
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
  std::unique_ptr<AnyFeatures> features(const AnyProblem& shape) const override {
    return std::make_unique<FeaturesOf<M>>(dynamic_cast<const Problem<M>&>(shape));
  }
  double follow(const AnyProblem& any, const AnyPlan& plan, AnyProblem& left) const noexcept override {
    const auto& problem = static_cast<const Problem<M>&>(any);
    auto& rest = static_cast<Problem<M>&>(left);
    const SwitchTiming timing(problem.modes, problem.horizon.dt_s);
    Rollout<M> r(problem);
    for (std::size_t b = 0; b + rest.horizon.blocks.size() < problem.horizon.blocks.size(); ++b)
      roll_block(problem, timing, plan.modes[b], problem.horizon.blocks[b],
                 static_cast<const Plan<M>&>(plan).continuous[b], r);
    rest.model = problem.model;
    rest.cost = problem.cost;
    rest.bounds = problem.bounds;
    rest.initial = r.state;
    rest.lines = r.lines;
    std::copy(problem.reference.end() - std::ssize(rest.reference), problem.reference.end(), rest.reference.begin());
    std::copy(problem.setpoint.end() - std::ssize(rest.setpoint), problem.setpoint.end(), rest.setpoint.begin());
    return r.feasible ? r.cost : Bounds<M>::infinity;
  }
};

}  // namespace detail

template <HybridModel M>
const ModelTools& model_tools() {
  static const detail::ModelToolsOf<M> tools;
  return tools;
}

}  // namespace solenoid
