#pragma once

#include "controllers/systems.hpp"
#include "core/safety/limits.hpp"
#include "experiments/rig/calibration.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// Board and channels behind libcomedi. The defaults are a MultiQ3 as the thesis wired it.
struct ComediSettings {
  std::string device = "/dev/comedi0";
  int input_subdevice = 0, position_channel = 0, pressure_a_channel = 1, pressure_b_channel = 2, input_range = 0;
  std::string reference = "ground";  ///< ground | common | diff
  int output_subdevice = 1, motor_channel = 0, output_range = 0;
  int digital_subdevice = 3;
  std::vector<int> coil_channels = {0, 1, 2, 3};  ///< of coil 0, 1, ...
  int watchdog_channel = -1;                      ///< toggles with every write; -1: none
};

/// A rig as data: what `run --rig FILE` reads. Tables [calibration], [comedi] (of the actuator alone) and [limits],
/// all optional.
struct RigFile {
  Calibration calibration;
  ComediSettings comedi;
  LadderSettings ladder;  ///< the system's for the variant that runs, with what the file says
  CommandRates rates;
  std::string text;  ///< what was read; empty: the defaults
};
/// For a variant that was told of its task. Throw ConfigError with file, line, key and what is allowed.
RigFile read_rig_file(const std::string& path, const VariantConfig& variant);
RigFile read_rig(TableReader table, const VariantConfig& variant);
/// What a rig is without a file.
RigFile usual_rig(const VariantConfig& variant);

}  // namespace solenoid
