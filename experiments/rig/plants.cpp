#include "experiments/rig/plants.hpp"

#include "core/config/reader.hpp"
#include "experiments/rig/calibration.hpp"
#include "experiments/rig/comedi_io.hpp"
#include "experiments/rig/faulty_plant.hpp"
#include "experiments/rig/udp_io.hpp"

#include <fmt/format.h>

namespace solenoid {

constexpr const char* rig_system = "actuator";  // whose calibration and wiring there are

void require_rig(const ScenarioConfig& scenario, const std::string& what) {
  if (system_of(scenario).name() != rig_system)
    throw ConfigError(fmt::format("{}: boards and nodes are of the {}, not of {} (allowed: sim)", what, rig_system,
                                  system_of(scenario).name()));
}

OpenedPlant open_plant(const PlantChoice& choice, const VariantConfig& variant, const ScenarioConfig& scenario,
                       std::uint64_t seed) {
  OpenedPlant opened;
  if (choice.kind != "sim") require_rig(scenario, "--plant " + choice.kind);
  std::unique_ptr<RigIo> io;
  if (choice.kind == "emulator") io = std::make_unique<UdpIo>(parse_node_address(choice.address));
  if (choice.kind == "comedi") io = make_comedi_io(choice.rig.comedi);
  if (io) {
    auto plant = std::make_unique<RigPlant>(std::move(io), choice.rig.calibration, variant.timing.tick_s);
    opened.rig = plant.get();
    opened.plant = std::move(plant);
    return opened;
  }
  opened.plant =
      std::make_unique<FaultyPlant>(make_plant(variant, scenario, seed), choice.faults, told(variant, scenario), seed);
  return opened;
}

}  // namespace solenoid
