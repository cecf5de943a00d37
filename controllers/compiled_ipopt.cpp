#include "controllers/compiled_solvers.hpp"
#include "solvers/nlp/relaxed_ipopt.hpp"

namespace solenoid {

template <HybridModel Model>
std::unique_ptr<RelaxedSolver<Model>> make_relaxed_ipopt() {
  return std::make_unique<RelaxedIpopt<Model, 2, 2>>();
}

template std::unique_ptr<RelaxedSolver<PneumaticActuator>> make_relaxed_ipopt();
template std::unique_ptr<RelaxedSolver<PrestabilisedActuator>> make_relaxed_ipopt();

}  // namespace solenoid
