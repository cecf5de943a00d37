#include "controllers/compiled_solvers.hpp"

namespace solenoid {

template <HybridModel Model>
std::unique_ptr<Solver<Model>> make_rounding(const ProjectedGradientSettings& relaxation,
                                             const RelaxAndRoundSettings& settings) {
  return std::make_unique<RelaxAndRound<Model>>(make_projected_gradient<Model>(relaxation), settings);
}

template <HybridModel Model>
std::unique_ptr<RelaxedSolver<Model>> make_projected_gradient(const ProjectedGradientSettings& settings) {
  return std::make_unique<ProjectedGradient<Model>>(settings);
}

template std::unique_ptr<Solver<PneumaticActuator>> make_rounding(const ProjectedGradientSettings&,
                                                                  const RelaxAndRoundSettings&);
template std::unique_ptr<Solver<PrestabilisedActuator>> make_rounding(const ProjectedGradientSettings&,
                                                                      const RelaxAndRoundSettings&);
template std::unique_ptr<RelaxedSolver<PneumaticActuator>> make_projected_gradient(const ProjectedGradientSettings&);
template std::unique_ptr<RelaxedSolver<PrestabilisedActuator>> make_projected_gradient(
    const ProjectedGradientSettings&);

}  // namespace solenoid
