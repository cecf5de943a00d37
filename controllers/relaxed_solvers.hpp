#pragma once

#include "core/actuator/prestabilised.hpp"
#include "core/mpc/relaxation.hpp"

#include <memory>

namespace solenoid {

/// The relaxed solvers of the catalogue. The size of a mode set is known when a problem is prepared: preparing throws
/// std::invalid_argument for one that is not compiled in (`sqp`: seven_mode; `ipopt`: two_way, seven_mode).
template <HybridModel Model>
std::unique_ptr<RelaxedSolver<Model>> make_relaxed_sqp();
template <HybridModel Model>
std::unique_ptr<RelaxedSolver<Model>> make_relaxed_ipopt();

}  // namespace solenoid
