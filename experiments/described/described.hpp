#pragma once

#include "controllers/compiled_relaxed.ipp"
#include "controllers/compiled_solvers.ipp"
#include "experiments/described/described_simulation.hpp"
#include "experiments/plugin/plugin.hpp"

/// For plug-ins with systems that are a model and what is said of it: ModelDescription.

/// Compiles a model's solvers; in one file of the plug-in, outside of namespaces, once for each model.
#define SOLENOID_COMPILE_MODEL(Model) \
  namespace solenoid {                \
  SOLENOID_COMPILE_SOLVERS(Model)     \
  SOLENOID_COMPILE_SQP(Model)         \
  SOLENOID_COMPILE_IPOPT(Model)       \
  }

namespace solenoid {

template <HybridModel M>
void Registry::add(ModelDescription said) {
  auto& system = *new DescribedSystem<M>(std::move(said));  // for ever: what was registered is never taken back
  add(system, *new DescribedSimulation<M>(system));
}

}  // namespace solenoid
