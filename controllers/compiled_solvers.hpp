#pragma once

#include "controllers/any_solver.hpp"
#include "core/mpc/relaxation.hpp"
#include "solvers/rounding/projected_gradient.hpp"
#include "solvers/rounding/relax_and_round.hpp"

#include <memory>

namespace solenoid {

/// Solvers for the models that controllers believe, each compiled once: whoever makes one from its class compiles it
/// again.
template <HybridModel M>
using RelaxedPtr = std::unique_ptr<RelaxedSolver<M>>;

/// The two halves of relaxing and rounding.
struct RoundingParts {
  ProjectedGradientSettings relaxation;
  RelaxAndRoundSettings rounding;
};
/// Makers of relaxing and rounding, for every model.
const MakerFor<AllModels, SolverPtr, const RoundingParts&>& rounding_makers();
/// Of the relaxed solver alone.
const MakerFor<AllModels, RelaxedPtr, const ProjectedGradientSettings&>& projected_gradient_makers();

/// The size of a mode set is known when a problem is prepared: preparing throws std::invalid_argument for one that is
/// not compiled in (sqp: seven_mode; ipopt: two_way, seven_mode). Sizes cost a compiler half a minute each, so not every
/// model has some.
struct AsCompiled {};
/// Makers of the relaxed SQP.
const MakerFor<AllModels, RelaxedPtr, AsCompiled>& relaxed_sqp_makers();
/// Of the reference, for the models of relaxed_sqp_makers().
const MakerFor<AllModels, RelaxedPtr, AsCompiled>& relaxed_ipopt_makers();

/// Relaxes and rounds.
template <HybridModel M>
SolverPtr<M> make_rounding(const ProjectedGradientSettings& relaxation, const RelaxAndRoundSettings& rounding) {
  return rounding_makers().of<M>({relaxation, rounding});
}
/// The relaxed solver alone, as make_rounding() has it.
template <HybridModel M>
RelaxedPtr<M> make_projected_gradient(const ProjectedGradientSettings& settings) {
  return projected_gradient_makers().of<M>(settings);
}
/// The relaxed SQP; null for a model that it is not compiled for.
template <HybridModel M>
RelaxedPtr<M> make_relaxed_sqp() {
  return relaxed_sqp_makers().makes<M>() ? relaxed_sqp_makers().of<M>({}) : nullptr;
}
/// The reference; null where make_relaxed_sqp() is.
template <HybridModel M>
RelaxedPtr<M> make_relaxed_ipopt() {
  return relaxed_ipopt_makers().makes<M>() ? relaxed_ipopt_makers().of<M>({}) : nullptr;
}

}  // namespace solenoid
