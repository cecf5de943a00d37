#pragma once

#include "core/metrics/metrics.hpp"
#include "core/rt/io.hpp"
#include "core/safety/plausibility.hpp"
#include "core/system/description.hpp"

#include <string>

namespace solenoid {

/// What was found before the first command of a run: the outputs safe, the sensors looked at for a tenth of a second.
struct Preflight {
  AxisValues at{};      ///< mean of each axis's channel
  FaultSet faults;      ///< of any sensor; none may be there
  int missed = 0;       ///< reads that brought nothing
  Percentiles read_us;  ///< I/O latency
  bool good() const { return faults.empty(); }
  std::string text(const SystemDescription& system) const;
};
/// Reads and commands nothing: outputs stay the safe ones they are after opening.
Preflight preflight(Plant& plant, const SystemDescription& system, const PlausibilitySettings& settings, double tick_s);

}  // namespace solenoid
