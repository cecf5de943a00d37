#pragma once

#include "core/mpc/relaxation.hpp"
#include "core/mpc/solver.hpp"
#include "core/systems/actuator/prestabilised.hpp"
#include "solvers/rounding/projected_gradient.hpp"
#include "solvers/rounding/relax_and_round.hpp"

#include <memory>

namespace solenoid {

/// Solvers for the two models that controllers believe, each compiled once: whoever makes one from its class compiles
/// it again.
template <HybridModel Model>
std::unique_ptr<Solver<Model>> make_rounding(const ProjectedGradientSettings& relaxation,
                                             const RelaxAndRoundSettings& settings);
/// The relaxed solver alone, as make_rounding() has it.
template <HybridModel Model>
std::unique_ptr<RelaxedSolver<Model>> make_projected_gradient(const ProjectedGradientSettings& settings);

/// The size of a mode set is known when a problem is prepared: preparing throws std::invalid_argument for one that is
/// not compiled in (sqp: seven_mode; ipopt: two_way, seven_mode).
template <HybridModel Model>
std::unique_ptr<RelaxedSolver<Model>> make_relaxed_sqp();
/// The reference, with the mode sets that make_relaxed_sqp() names.
template <HybridModel Model>
std::unique_ptr<RelaxedSolver<Model>> make_relaxed_ipopt();

}  // namespace solenoid
