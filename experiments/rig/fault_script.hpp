#pragma once

#include <string>
#include <vector>

namespace solenoid {

/// A fault that is provoked on purpose, from a moment on and for a while.
struct InjectedFault {
  std::string target;  ///< position, pressure_a, pressure_b, valves, supply, packets, process, solver, disk
  std::string kind;
  double value = 0.0;
  double from_s = 0.0, until_s = 0.0;  ///< on the plant's time

  bool active(double time_s) const { return time_s >= from_s && time_s < until_s; }
};

/// Reads `TARGET:KIND[=VALUE]@FROM_S[+DURATION_S]`; without a duration it stays. Throws ConfigError naming what is
/// allowed.
///
///     position, pressure_a, pressure_b   off | stuck | garbage | offset=METRES or PASCAL | slow=TIME_CONSTANT_S |
///                                        delayed=S | intermittent=PERIOD_S (off for a tenth of it)
///     valves                             stuck | swapped
///     supply                             lost
///     packets                            lost=SHARE | late=MS | repeated=SHARE | corrupt=SHARE
///     process                            killed | stopped=S | crashed
///     solver                             late=MS | hang | nan | throw
///     disk                               slow=MS, each write of the log | full | read_only
InjectedFault parse_fault(const std::string& text);
std::vector<InjectedFault> parse_faults(const std::vector<std::string>& texts);

/// The grammar above, for help texts.
std::string fault_help();

}  // namespace solenoid
