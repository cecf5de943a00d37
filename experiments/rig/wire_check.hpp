#pragma once

#include "experiments/rig/calibration.hpp"

#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// What a wire may be for a loop at its tick. Estimators that are told the age of values (late_values.hpp) do with
/// samples that are a few ticks old and with some missing; eleven ticks in a row without one are SAFE, which at a share
/// p of losses, one as likely as the other, happens less than once an hour at 1 kHz where p^11 3.6e6 < 1: p < 0.25.
struct WireLimits {
  double wait_s = 400e-6;  ///< of a read: an answer within it is of the tick that asked
  double jitter_s = 2e-3;  ///< of one direction; beyond, answers must come within the wait
  double loss = 0.25;      ///< of requests without an answer: lost either way, or overtaken by the next
  double drift = 100e-6;   ///< of two crystals; beyond, ages are not what they are said to be
};

/// One thing that a wire was looked at for.
struct WireFinding {
  std::string name;
  bool good;
  std::string detail;
};

/// Reads at the tick's rate for so long; commands nothing: outputs stay the safe ones. None if there is no far side
/// with a clock of its own.
std::optional<WireHealth> watch_wire(RigPlant& rig, double seconds, double tick_s);

/// Round trip, jitter, loss and the clock's drift, and in words whether the wire does for this tick.
std::vector<WireFinding> wire_checks(const WireHealth& wire, double tick_s, const WireLimits& limits = {});

}  // namespace solenoid
