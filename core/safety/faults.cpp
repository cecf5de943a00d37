#include "core/safety/faults.hpp"

#include <array>

namespace solenoid {
namespace {

constexpr std::array<const char*, sensor_fault_kinds> kinds = {"not finite", "range", "rail",   "slew",
                                                               "stuck",      "stale", "supply", "innovation"};

}  // namespace

std::string to_string(FaultSet faults, const SystemDescription& system) {
  const std::array<std::string, other_faults> others = {system.axis_limit_name,
                                                        system.channel_limit_name,
                                                        "command refused",
                                                        "tick gap",
                                                        "I/O safe",
                                                        "no plan",
                                                        "stopped",
                                                        "aborted",
                                                        system.switch_noun + " failed",
                                                        "too many " + system.switch_noun + "s failed"};
  std::string text;
  const auto add = [&text](const std::string& name) { text += (text.empty() ? "" : ", ") + name; };
  for (std::size_t channel = 0; channel < system.channels.size(); ++channel)
    for (std::size_t kind = 0; kind < kinds.size(); ++kind)
      if (faults.has(channel, static_cast<SensorFault>(kind))) add(system.channels[channel].label + " " + kinds[kind]);
  for (std::size_t other = 0; other < others.size(); ++other)
    if (faults.has(static_cast<Fault>(other))) add(others[other]);
  return text.empty() ? "none" : text;
}

}  // namespace solenoid
