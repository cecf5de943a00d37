#pragma once

#include "experiments/campaign/simulated_system.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// A fault that is provoked on purpose, from a moment on and for a while.
struct InjectedFault {
  std::string
      target;  ///< a measured channel's name, what the system names of its actuation, packets, process, solver, disk
  std::string kind;
  double value = 0.0;
  double from_s = 0.0, until_s = 0.0;  ///< on the plant's time

  bool active(double time_s) const { return time_s >= from_s && time_s < until_s; }
};

/// Reads `TARGET:KIND[=VALUE]@FROM_S[+DURATION_S]`; without a duration it stays. Throws ConfigError naming what is
/// allowed.
///
///     a channel of the system            off | stuck | garbage | offset=VALUE [its unit] | slow=TIME_CONSTANT_S |
///                                        delayed=S | intermittent=PERIOD_S (off for a tenth of it) | inverted and
///                                        gain=FACTOR about the middle of its converter | swapped=CHANNEL: their wires
///                                        are exchanged (value: the other's number)
///     switches                           stuck
///     SimulatedSystem::actuation_faults  of the system: of the actuator valves stuck | swapped, coils_a and coils_b
///                                        swapped, motor inverted | lost, supply lost | factor=FACTOR, chamber_a and
///                                        chamber_b leaking=SHARE, and of each coil of the variant, coil_supply_a,
///                                        stuck_open | stuck_closed | leaking=SHARE (closed, so much of it stays
///                                        open) | slow=S (both edges later)
///     packets                            lost=SHARE | late=MS | jitter=MS (0 to so many, each its own, so that they
///                                        overtake each other), in both directions | repeated=SHARE | corrupt=SHARE
///     process                            killed | stopped=S | crashed
///     solver                             late=MS | hang | nan | throw
///     disk                               slow=MS, each write of the log | full | read_only
InjectedFault parse_fault(const std::string& text, const SimulatedSystem& system);
std::vector<InjectedFault> parse_faults(const std::vector<std::string>& texts, const SimulatedSystem& system);

/// The grammar above, for help texts.
std::string fault_help(const SimulatedSystem& system);

}  // namespace solenoid
