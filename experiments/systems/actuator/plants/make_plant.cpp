#include "experiments/systems/actuator/plants/make_plant.hpp"

#include "experiments/systems/actuator/plants/model_plant.hpp"
#include "experiments/systems/actuator/twin/twin_plant.hpp"

namespace solenoid {

std::unique_ptr<SimulatedPlant> make_plant(const VariantConfig& variant, const PlantConfig& config, double start_m,
                                           std::uint64_t seed) {
  check_tick(config, variant.timing.tick_s, "plant");
  if (config.plant == "twin")
    return std::make_unique<TwinPlant>(twin_for(config.twin, {config.plane, config.payload_kg, config.mismatch}),
                                       variant.valves, start_m,
                                       TwinPlant::Sensing{config.ideal_sensing, config.noise, seed});
  ActuatorParameters parameters = config.mismatch.applied_to(variant.nominal);
  parameters.payload_mass_kg = config.payload_kg;
  parameters.plane = config.plane;
  auto plant = std::make_unique<ModelPlant>(
      parameters, variant.valves, start_m,
      ModelPlant::Sensing{config.ideal_sensing, config.noise, config.sensing_chain, {}, seed}, variant.timing.tick_s);
  if (config.kick) plant->push_at(config.kick->at_s, config.kick->speed_m_s);
  return plant;
}

}  // namespace solenoid
