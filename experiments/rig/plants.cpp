#include "experiments/rig/plants.hpp"

#include "core/config/reader.hpp"
#include "experiments/rig/calibration.hpp"
#include "experiments/rig/comedi_io.hpp"
#include "experiments/rig/faulty_plant.hpp"
#include "experiments/rig/udp_io.hpp"

#include <cstdio>

#include <fmt/format.h>

namespace solenoid {
namespace {

UdpSettings node_of(const PlantChoice& choice) { return parse_node_address(node_address(choice)); }

std::unique_ptr<RigIo> node_io(const PlantChoice& choice, const VariantConfig& variant) {
  UdpSettings settings = timed_for(node_of(choice), variant.timing.tick_s);
  const std::string& key_file = choice.key_file.empty() ? choice.rig.node.key_file : choice.key_file;
  if (!key_file.empty()) settings.key = read_node_key(key_file);
  if (!settings.key && !on_loopback(settings))
    fmt::print(stderr,
               "WARNING: I/O node {} is reached without a key: whoever is on the network can drive the rig "
               "(docs/reference/rig.md, \"Keys\")\n",
               settings.text());
  return std::make_unique<UdpIo>(settings, node_wire(variant));
}

}  // namespace

NodeWire node_wire(const VariantConfig& variant) {
  const System& system = system_of(variant);
  const SystemDescription& described = system.description_for(variant);
  return {wire_text(described, system.modes(variant)), described.channels.size(), described.continuous.size()};
}

const std::string& node_address(const PlantChoice& choice) {
  return choice.address.empty() ? choice.rig.node.address : choice.address;
}

bool drives_scenario(const PlantChoice& choice) {
  return choice.kind == "sim" || (choice.kind == "emulator" && on_loopback(node_of(choice)));
}

void expect_noise(PlantChoice& choice, const ScenarioConfig& scenario) {
  if (drives_scenario(choice)) expect_noise(choice.rig, simulation_of(scenario).noise(scenario));
}

OpenedPlant open_plant(const PlantChoice& choice, const VariantConfig& variant, const ScenarioConfig& scenario,
                       std::uint64_t seed) {
  OpenedPlant opened;
  std::unique_ptr<RigIo> io;
  if (choice.kind == "emulator") io = node_io(choice, variant);
  if (choice.kind == "comedi") io = make_comedi_io(choice.rig.comedi);
  if (io) {
    auto plant = std::make_unique<RigPlant>(std::move(io), choice.rig.calibration, variant);
    opened.rig = plant.get();
    opened.guard = std::make_unique<RigGuard>(plant->io());
    opened.plant = std::move(plant);
    return opened;
  }
  opened.plant =
      std::make_unique<FaultyPlant>(make_plant(variant, scenario, seed), choice.faults, told(variant, scenario), seed);
  return opened;
}

}  // namespace solenoid
