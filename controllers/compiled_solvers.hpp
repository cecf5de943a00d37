#pragma once

#include "controllers/any_solver.hpp"
#include "core/mpc/relaxation.hpp"
#include "solvers/rounding/projected_gradient.hpp"
#include "solvers/rounding/relax_and_round.hpp"
#include "solvers/sampling/sampling_settings.hpp"

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <tuple>

namespace solenoid {

/// Solvers for the models that controllers believe, each compiled once: whoever makes one from its class compiles it
/// again. They are defined in compiled_solvers.ipp and compiled_relaxed.ipp; a model has one file that compiles them.
template <HybridModel M>
using RelaxedPtr = std::unique_ptr<RelaxedSolver<M>>;

class Mlp;

/// Branch and bound, with what the network, if there is one, proposes among its incumbents; or without pruning every
/// sequence.
template <HybridModel M>
SolverPtr<M> make_tree_search(bool prune, std::shared_ptr<const Mlp> proposing = nullptr);
/// A network proposes sequences, their prediction chooses.
template <HybridModel M>
SolverPtr<M> make_policy(std::shared_ptr<const Mlp> network);
/// The first blocks are searched, the network says what the others cost.
template <HybridModel M>
SolverPtr<M> make_tail_search(std::shared_ptr<const Mlp> network, int searched_blocks);
/// Relaxes and rounds.
template <HybridModel M>
SolverPtr<M> make_rounding(const ProjectedGradientSettings& relaxation, const RelaxAndRoundSettings& rounding);
/// The relaxed solver alone, as make_rounding() has it.
template <HybridModel M>
RelaxedPtr<M> make_projected_gradient(const ProjectedGradientSettings& settings);
/// Samples sequences.
template <HybridModel M>
SolverPtr<M> make_sampling(const ModeSamplingSettings& settings);
/// By Bonmin; of the algorithms in `minlp.algorithm` (variant_keys.cpp).
template <HybridModel M>
SolverPtr<M> make_bonmin(const std::string& algorithm);

/// A size of the relaxed problem: weights of the modes' hull, rows of memory (solvers/sqp/sqp.hpp).
template <int weights, int memory>
struct SqpSize;
/// The sizes that SQP and Ipopt are compiled in for a model. Each costs a compiler half a minute, so there are none where
/// a model does not say so.
template <HybridModel M>
struct RelaxedSizes {
  using Sqp = std::tuple<>;
  using Ipopt = std::tuple<>;
};
/// The relaxed SQP. The size is known when a problem is prepared: preparing throws std::invalid_argument for a mode set
/// of a size that is not compiled. Null for a model without sizes.
template <HybridModel M>
RelaxedPtr<M> make_relaxed_sqp();
/// The reference, by Ipopt; the same of its sizes.
template <HybridModel M>
RelaxedPtr<M> make_relaxed_ipopt();

/// The lower end of a problem: what its relaxation costs.
class RelaxedBound {
 public:
  virtual ~RelaxedBound() = default;
  /// The best relaxed plan found downwards from an integer one: projected gradients, which cross the physics' kinks, then
  /// SQP for a first-order point, where it is compiled. status: optimal at such a point.
  virtual SolveReport solve(const AnyProblem& problem, const AnyPlan& start) = 0;
};

/// What networks are told of problems of one shape (solvers/learned/problem_features.hpp).
class AnyFeatures {
 public:
  virtual ~AnyFeatures() = default;
  /// How many there are.
  virtual std::size_t size() const = 0;
  /// What they are of, as a network of modes keeps it.
  virtual std::string layout() const = 0;
  /// The same with the weights of the cost, as a network of costs keeps it.
  virtual std::string cost_layout() const = 0;
  /// shapes   into: size()
  virtual void write(const AnyProblem& problem, std::span<float> into) const noexcept = 0;
};

/// What of a model is asked by whoever knows its problems as AnyProblem alone.
class ModelTools {
 public:
  virtual ~ModelTools() = default;
  /// The independent judge, evaluate() of core/mpc/rollout.hpp.
  virtual SolveReport evaluate(const AnyProblem& problem, AnyPlan& plan) const noexcept = 0;
  /// make_rounding().
  virtual AnySolverPtr rounding(const ProjectedGradientSettings& relaxation,
                                const RelaxAndRoundSettings& rounding) const = 0;
  /// For problems of this shape.
  virtual std::unique_ptr<RelaxedBound> relaxed_bound(const AnyProblem& shape) const = 0;
  /// For problems of this shape.
  virtual std::unique_ptr<AnyFeatures> features(const AnyProblem& shape) const = 0;
  /// Makes `rest`, a problem over the last blocks of `problem`, begin where the plan's blocks before those lead. Returns what
  /// they cost; infinity where they break a limit.
  virtual double follow(const AnyProblem& problem, const AnyPlan& plan, AnyProblem& rest) const noexcept = 0;
};
/// Those of a model.
template <HybridModel M>
const ModelTools& model_tools();

}  // namespace solenoid
