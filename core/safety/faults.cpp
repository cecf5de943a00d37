#include "core/safety/faults.hpp"

#include <array>

namespace solenoid {
namespace {

constexpr std::array<const char*, sensor_count> sensors = {"position", "pressure A", "pressure B"};
constexpr std::array<const char*, sensor_fault_kinds> kinds = {"not finite", "range", "rail",   "slew",
                                                               "stuck",      "stale", "supply", "innovation"};
constexpr std::array<const char*, fault_kinds - sensor_count* sensor_fault_kinds> others = {
    "position limit", "pressure limit", "command refused", "tick gap", "I/O safe", "no plan", "stopped", "aborted"};

std::string name(int bit) {
  const auto i = static_cast<std::size_t>(bit), of_sensors = sensors.size() * kinds.size();
  if (i < of_sensors) return std::string(sensors[i / kinds.size()]) + " " + kinds[i % kinds.size()];
  return others[i - of_sensors];
}

}  // namespace

std::string to_string(FaultSet faults) {
  std::string text;
  for (int bit = 0; bit < fault_kinds; ++bit)
    if ((faults.bits() >> bit) & 1u) text += (text.empty() ? "" : ", ") + name(bit);
  return text.empty() ? "none" : text;
}

}  // namespace solenoid
