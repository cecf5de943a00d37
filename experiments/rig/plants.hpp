#pragma once

#include "experiments/campaign/campaign.hpp"
#include "experiments/rig/fault_script.hpp"
#include "experiments/rig/rig_file.hpp"

#include <memory>
#include <string>
#include <vector>

namespace solenoid {

class RigPlant;

/// Which plant a run drives, and how it is reached.
struct PlantChoice {
  std::string kind = "sim";                 ///< sim | emulator | comedi
  RigFile rig;                              ///< calibration and wiring
  std::string address = "127.0.0.1:47811";  ///< of the UDP I/O node
  std::vector<InjectedFault> faults;        ///< of a simulated plant
};

/// A plant ready for its first read. Throws ConfigError or OutputError. `sim` is the scenario's own plant in real time.
struct OpenedPlant {
  std::unique_ptr<Plant> plant;
  RigPlant* rig = nullptr;  ///< plant, if it is behind a RigIo
};
/// Boards, nodes and calibration are one system's: throws ConfigError for a task of another. `what`: asks for them.
void require_rig(const ScenarioConfig& scenario, const std::string& what);

OpenedPlant open_plant(const PlantChoice& choice, const VariantConfig& variant, const ScenarioConfig& scenario,
                       std::uint64_t seed);

}  // namespace solenoid
