#include "controllers/compiled_solvers.hpp"

namespace solenoid {

const MakerFor<AllModels, SolverPtr, const RoundingParts&>& rounding_makers() {
  static const MakerFor<AllModels, SolverPtr, const RoundingParts&> makers =
      []<HybridModel M>(const RoundingParts& parts) -> SolverPtr<M> {
    return std::make_unique<RelaxAndRound<M>>(make_projected_gradient<M>(parts.relaxation), parts.rounding);
  };
  return makers;
}

const MakerFor<AllModels, RelaxedPtr, const ProjectedGradientSettings&>& projected_gradient_makers() {
  static const MakerFor<AllModels, RelaxedPtr, const ProjectedGradientSettings&> makers =
      []<HybridModel M>(const ProjectedGradientSettings& settings) -> RelaxedPtr<M> {
    return std::make_unique<ProjectedGradient<M>>(settings);
  };
  return makers;
}

}  // namespace solenoid
