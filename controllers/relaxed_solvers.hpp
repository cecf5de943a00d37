#pragma once

#include "core/actuator/prestabilised.hpp"
#include "core/mpc/relaxation.hpp"

#include <memory>
#include <string>

namespace solenoid {

/// The relaxed solver of this name, one of VariantChoices::relaxed_solvers(), for problems like this one: `sqp` for all
/// valve configurations but seven_mode, `ipopt` for three_way. Throws std::invalid_argument for any other.
template <HybridModel Model>
std::unique_ptr<RelaxedSolver<Model>> make_relaxed_solver(const std::string& name, const Problem<Model>& problem);

template <HybridModel Model>
std::unique_ptr<RelaxedSolver<Model>> make_relaxed_sqp(const Problem<Model>& problem);
template <HybridModel Model>
std::unique_ptr<RelaxedSolver<Model>> make_relaxed_ipopt(const Problem<Model>& problem);

}  // namespace solenoid
