#include "controllers/compiled_solvers.hpp"
#include "solvers/nlp/relaxed_ipopt.hpp"

namespace solenoid {

const MakerFor<AllModels, RelaxedPtr, AsCompiled>& relaxed_ipopt_makers() {
  static const MakerFor<AllModels, RelaxedPtr, AsCompiled> makers = []<ActuatorModel M>(AsCompiled) -> RelaxedPtr<M> {
    return std::make_unique<RelaxedIpopt<M, 2, 2>>();
  };
  return makers;
}

}  // namespace solenoid
