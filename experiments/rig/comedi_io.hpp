#pragma once

#include "experiments/rig/rig_file.hpp"
#include "experiments/rig/rig_io.hpp"

#include <memory>

namespace solenoid {

/// A board behind libcomedi, which is loaded when it is asked for: no rig, no need of it. All inputs in one instruction
/// list, all coils (and the watchdog) in one masked write. Throws ConfigError naming the Debian package if this program
/// was built without libcomedi's header.
std::unique_ptr<RigIo> make_comedi_io(const ComediSettings& settings);

/// Whether this program can drive it, and what is missing if not.
struct ComediSupport {
  bool built = false, library = false;
  std::string detail;
};
ComediSupport comedi_support();

}  // namespace solenoid
