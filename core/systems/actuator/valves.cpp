#include "core/systems/actuator/valves.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

Switch coil(const char* name, const ActuatorParameters& p) {
  return {name, p.energise_delay_s, p.deenergise_delay_s, 0.0};
}

ModeSet three_way(const ActuatorParameters& p) {
  return {"three_way",
          {coil("A", p), coil("B", p)},
          {{"exhaust A, exhaust B", 0}, {"fill A, exhaust B", 1}, {"exhaust A, fill B", 2}, {"fill A, fill B", 3}},
          {0, 1, 0, 1},
          {{1, -1, 0, 0}, {0, 0, 1, -1}}};
}

/// Two-way valves: coil bits 0 supply A, 1 exhaust A, 2 supply B, 3 exhaust B. `chamber_modes` are pairs of chamber
/// actions, 0 blocked, 1 fill, 2 exhaust.
ModeSet two_way(const char* name, const std::vector<std::pair<int, int>>& chamber_modes, const ActuatorParameters& p) {
  static constexpr const char* action[] = {"hold", "fill", "exhaust"};
  std::vector<Mode> modes;
  for (const auto& [a, b] : chamber_modes)
    modes.push_back({fmt::format("{} A, {} B", action[a], action[b]), static_cast<SwitchPattern>(a | (b << 2))});
  return {name,
          {coil("supply A", p), coil("exhaust A", p), coil("supply B", p), coil("exhaust B", p)},
          modes,
          {0, 0, 0, 0},
          {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
}

}  // namespace

const std::vector<std::string>& valve_configurations() {
  static const std::vector<std::string> names = {"three_way", "two_way", "three_mode", "seven_mode"};
  return names;
}

ModeSet valve_modes(const std::string& configuration, const ActuatorParameters& p) {
  if (configuration == "three_way") return three_way(p);
  if (configuration == "two_way")
    return two_way("two_way", {{0, 0}, {0, 1}, {0, 2}, {1, 0}, {1, 1}, {1, 2}, {2, 0}, {2, 1}, {2, 2}}, p);
  if (configuration == "three_mode") return two_way("three_mode", {{0, 0}, {1, 2}, {2, 1}}, p);
  if (configuration == "seven_mode")
    return two_way("seven_mode", {{0, 0}, {0, 1}, {0, 2}, {1, 0}, {1, 2}, {2, 0}, {2, 1}}, p);
  throw std::invalid_argument(
      fmt::format("valves: '{}' is not known; allowed: {}", configuration, fmt::join(valve_configurations(), ", ")));
}

}  // namespace solenoid
