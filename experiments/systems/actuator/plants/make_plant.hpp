#pragma once

#include "controllers/variant.hpp"
#include "experiments/plants/simulated_plant.hpp"
#include "experiments/systems/actuator/plants/plant_config.hpp"

#include <memory>

namespace solenoid {

/// The plant with this variant's valves, at rest at `start_m`: "model" has the variant's nominal parameters, "twin"
/// its own.
std::unique_ptr<SimulatedPlant> make_plant(const VariantConfig& variant, const PlantConfig& config, double start_m,
                                           std::uint64_t seed);

}  // namespace solenoid
