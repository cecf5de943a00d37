#include "controllers/relaxed_solvers.hpp"
#include "solvers/sqp/sqp.hpp"

namespace solenoid {

template <HybridModel Model>
std::unique_ptr<RelaxedSolver<Model>> make_relaxed_sqp(const Problem<Model>& problem) {
  return make_sqp(problem, {.max_iterations = 8}, std::tuple<SqpSize<2, 2>, SqpSize<4, 4>>());
}

template std::unique_ptr<RelaxedSolver<PneumaticActuator>> make_relaxed_sqp(const Problem<PneumaticActuator>&);
template std::unique_ptr<RelaxedSolver<PrestabilisedActuator>> make_relaxed_sqp(const Problem<PrestabilisedActuator>&);

}  // namespace solenoid
