#pragma once

#include "experiments/rig/calibration.hpp"

#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// What a wire may be for a loop at its tick. Estimators that are told the age of values (late_values.hpp) do with
/// samples that are a few ticks old and with some missing. A share p of requests without an answer, one as likely as the
/// other, and of commands that do not arrive, may end a run in SAFE less than once an hour: eleven ticks in a row
/// without a sample, or as many lost commands as the node waits for,
///
///     p^n 3600 s / tick < 1,    n the lesser of 11 and node_timeout / tick
///
/// which at 1 kHz is p < 0.25, and at 100 Hz, where one lost command is a timeout of the node, next to none.
struct WireLimits {
  double wait_s;        ///< of a read: an answer within it is of the tick that asked
  double jitter_s;      ///< of one direction, two ticks; beyond, answers must come within the wait
  double delay_s;       ///< of the quickest round trip, five ticks: what the loop has in dead time
  double age_s;         ///< of a sample: what a read still takes
  double loss;          ///< of requests without an answer: lost either way, or overtaken by the next
  double empty = 0.5;   ///< of reads that have nothing newer
  double drift = 1e-4;  ///< of two crystals; beyond, ages are not what they are said to be
};
WireLimits wire_limits(double tick_s);

/// One thing that a wire was looked at for.
struct WireFinding {
  std::string name;
  bool good;
  std::string detail;
};

/// Reads at the tick's rate for so long, counted from then on; commands nothing: outputs stay the safe ones. None if there is no far side
/// with a clock of its own.
std::optional<WireHealth> watch_wire(RigPlant& rig, double seconds, double tick_s);

/// Round trip, jitter, age, loss and the clock's drift, and in words whether the wire does for this tick.
std::vector<WireFinding> wire_checks(const WireHealth& wire, double tick_s);

}  // namespace solenoid
