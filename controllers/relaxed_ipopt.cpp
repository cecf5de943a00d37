#include "solvers/nlp/relaxed_ipopt.hpp"

#include "controllers/relaxed_solvers.hpp"

namespace solenoid {

template <HybridModel Model>
std::unique_ptr<RelaxedSolver<Model>> make_relaxed_ipopt(const Problem<Model>& problem) {
  if (transcription_sizes(problem) != std::array{2, 2})
    throw std::invalid_argument("ipopt: no solver for the size of mode set '" + problem.modes.name() +
                                "' (allowed: three_way, three_mode)");
  return std::make_unique<RelaxedIpopt<Model, 2, 2>>();
}

template <HybridModel Model>
std::unique_ptr<RelaxedSolver<Model>> make_relaxed_solver(const std::string& name, const Problem<Model>& problem) {
  if (name == "sqp") return make_relaxed_sqp(problem);
  if (name == "ipopt") return make_relaxed_ipopt(problem);
  throw std::invalid_argument("relaxed solver '" + name + "' is not known");
}

template std::unique_ptr<RelaxedSolver<PneumaticActuator>> make_relaxed_solver(const std::string&,
                                                                               const Problem<PneumaticActuator>&);
template std::unique_ptr<RelaxedSolver<PrestabilisedActuator>> make_relaxed_solver(
    const std::string&, const Problem<PrestabilisedActuator>&);

}  // namespace solenoid
