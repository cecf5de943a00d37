#pragma once

#include "controllers/described_system.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/plants/simulated_model.hpp"

#include <memory>
#include <vector>

namespace solenoid {

/// What a scenario of a described system says beside what every scenario does: `plant`, parameters by name in place of
/// what the variant believes, and `start`, states by name. Without `trajectory` outputs are to keep their targets.
struct DescribedScenario {
  std::vector<double> parameters;  ///< NaN: as the variant believes
  std::vector<double> start;
};

/// What of such a simulation knows no model's type.
class DescribedSimulationBase : public SimulatedSystem {
 public:
  explicit DescribedSimulationBase(const System& system, const DescribedParts& parts)
      : system_(system), parts_(parts) {}

  const System& system() const override { return system_; }
  void read(TableReader& table, ScenarioConfig& scenario) const override;
  Metrics evaluate(const VariantConfig& variant, const ScenarioConfig& scenario, std::span<const TickRecord> ticks,
                   const Consumed& consumed) const override;

 protected:
  const DescribedParts& parts() const { return parts_; }
  /// Of the plant.
  std::vector<double> parameters(const VariantConfig& variant, const ScenarioConfig& scenario) const;
  std::vector<double> start(const ScenarioConfig& scenario) const;

 private:
  const System& system_;
  const DescribedParts& parts_;
};

/// How a described system is simulated: its model, with the parameters of the scenario. `system` must outlive it.
template <HybridModel M>
class DescribedSimulation final : public DescribedSimulationBase {
 public:
  explicit DescribedSimulation(const DescribedSystem<M>& system) : DescribedSimulationBase(system, system.parts()) {}

  std::unique_ptr<SimulatedPlant> make_plant(const VariantConfig& v, const ScenarioConfig& s,
                                             std::uint64_t seed) const override {
    typename SimulatedModel<M>::Sensing sensing{.channels = {}, .ideal = s.ideal_sensing, .seed = seed};
    for (const ModelDescription::Channel& channel : parts().said().channels)
      sensing.channels.push_back(KalmanChannel<M>::of(parts().state_of(channel.state), s.noise ? channel.sigma : 0.0));
    const std::vector<double> from = start(s), values = parameters(v, s);
    StateOf<M> state;
    std::copy_n(from.begin(), state.size(), state.begin());
    return std::make_unique<SimulatedModel<M>>(M(std::span<const double>(values)), system().modes(v), state,
                                               v.timing.tick_s, std::move(sensing));
  }
};

}  // namespace solenoid
