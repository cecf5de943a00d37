#pragma once

#include "controllers/systems.hpp"
#include "core/safety/limits.hpp"
#include "experiments/rig/calibration.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// Board and channels behind libcomedi. The defaults are a MultiQ3 as the thesis wired it: inputs from channel 0 on,
/// outputs too, switches likewise.
struct ComediSettings {
  /// Of a continuous input.
  struct Output {
    int subdevice = 1, channel = 0, range = 0;
  };
  std::string device = "/dev/comedi0";
  int input_subdevice = 0, input_range = 0;
  std::vector<int> input_channels;   ///< of the system's channels, in their order
  std::string reference = "ground";  ///< ground | common | diff
  std::vector<Output> outputs;       ///< of its continuous inputs
  int digital_subdevice = 3;
  std::vector<int> switch_channels;  ///< of switch 0, 1, ...
  int watchdog_channel = -1;         ///< toggles with every write; -1: none
  std::uint32_t safe_switches = 0;   ///< the pattern of the safe outputs
};

/// How the I/O node is reached.
struct NodeSettings {
  std::string address = "127.0.0.1:47811";
  std::string key_file;  ///< none: packets are not authenticated
};

/// A rig as data: what `run --rig FILE` reads. Tables [calibration], [comedi], [node] and [limits], all optional.
struct RigFile {
  Calibration calibration;
  ComediSettings comedi;
  NodeSettings node;
  LadderSettings ladder;  ///< the system's for the variant that runs, with what the file says
  CommandRates rates;
  std::string text;  ///< what was read; empty: the defaults
};
/// For a variant that was told of its task. Throw ConfigError with file, line, key and what is allowed.
RigFile read_rig_file(const std::string& path, const VariantConfig& variant);
RigFile read_rig(TableReader table, const VariantConfig& variant);
/// What a rig is without a file.
RigFile usual_rig(const VariantConfig& variant);

/// Has the sensors' noise said by the plant (SimulatedSystem::noise) where the rig's file does not say it: what rests
/// is told from what is stuck by it. Of channels that the system watches so; none may be stated.
void expect_noise(RigFile& rig, const std::vector<ChannelNoise>& of_plant);

}  // namespace solenoid
