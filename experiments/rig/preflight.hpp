#pragma once

#include "core/metrics/metrics.hpp"
#include "core/rt/io.hpp"
#include "core/safety/plausibility.hpp"

#include <string>

namespace solenoid {

/// What was found before the first command of a run: the outputs safe, the sensors looked at for a tenth of a second.
struct Preflight {
  double position_m = 0.0;  ///< mean
  FaultSet faults;          ///< of any sensor; none may be there
  int missed = 0;           ///< reads that brought nothing
  Percentiles read_us;      ///< I/O latency
  bool good() const { return faults.empty(); }
  std::string text() const;
};
/// Commands nothing but safe outputs.
Preflight preflight(Plant& plant, const PlausibilitySettings& settings, double tick_s);

}  // namespace solenoid
