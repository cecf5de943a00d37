#pragma once

#include "experiments/campaign/campaign.hpp"
#include "experiments/rig/fault_script.hpp"
#include "experiments/rig/rig_file.hpp"
#include "experiments/rig/rig_guard.hpp"

#include <memory>
#include <string>
#include <vector>

namespace solenoid {

class RigPlant;
struct NodeWire;

/// Which plant a run drives, and how it is reached.
struct PlantChoice {
  std::string kind = "sim";           ///< sim | emulator | comedi
  RigFile rig;                        ///< calibration and wiring
  std::string address;                ///< of the UDP I/O node; empty: the rig's
  std::string key_file;               ///< shared with it; empty: the rig's
  std::vector<InjectedFault> faults;  ///< of a simulated plant
};

/// ADDRESS:PORT of the node that `emulator` is reached at.
const std::string& node_address(const PlantChoice& choice);
/// Whether the plant is the scenario's: `sim`, or a node on this computer (127.0.0.0/8), which is the emulator. A node
/// elsewhere is a rig, as what is behind a board is. Throws ConfigError: the node's address is none.
bool drives_scenario(const PlantChoice& choice);
/// Has the noise of its sensors said by the scenario, where that is the plant and the rig's file does not state it.
void expect_noise(PlantChoice& choice, const ScenarioConfig& scenario);

/// A plant ready for its first read. `sim` is the scenario's own plant in real time.
struct OpenedPlant {
  std::unique_ptr<Plant> plant;
  RigPlant* rig = nullptr;          ///< plant, if it is behind a RigIo
  std::unique_ptr<RigGuard> guard;  ///< of its io; ends before it
};
/// Throws ConfigError or OutputError. Warns on standard error of a node on the network that is not authenticated.
OpenedPlant open_plant(const PlantChoice& choice, const VariantConfig& variant, const ScenarioConfig& scenario,
                       std::uint64_t seed);

/// What an I/O node of the variant's switches must have on its wire.
NodeWire node_wire(const VariantConfig& variant);

}  // namespace solenoid
