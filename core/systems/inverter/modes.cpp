#include "core/systems/inverter/modes.hpp"

#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

Switch gate(const std::string& name, const InverterParameters& p) {
  return {name, p.switching_delay_s, p.switching_delay_s, 0.0};
}

/// A level that a phase can have, as its gate signals give it.
struct PhaseLevel {
  char name;
  SwitchPattern signals;
};

/// Every combination of the three phases' levels, phase a counting slowest; `signals` gate signals a phase.
std::vector<Mode> combined(const std::vector<PhaseLevel>& levels, int signals) {
  std::vector<Mode> modes;
  for (const PhaseLevel& a : levels)
    for (const PhaseLevel& b : levels)
      for (const PhaseLevel& c : levels)
        modes.push_back({{a.name, b.name, c.name}, a.signals | b.signals << signals | c.signals << 2 * signals});
  return modes;
}

ModeSet three_level(const InverterParameters& p) {
  std::vector<Switch> switches;
  for (const char* name : {"a lower", "a upper", "b lower", "b upper", "c lower", "c upper"})
    switches.push_back(gate(name, p));
  return {"three_level",
          switches,
          combined({{'0', 0b01}, {'+', 0b11}, {'-', 0b00}}, 2),
          {-1, -1, -1},
          {{1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 1}},
          {0b000011, 0b001100, 0b110000},
          0b010101};
}

ModeSet two_level(const InverterParameters& p) {
  return {"two_level",
          {gate("a", p), gate("b", p), gate("c", p)},
          combined({{'-', 0}, {'+', 1}}, 1),
          {-1, -1, -1},
          {{2, 0, 0}, {0, 2, 0}, {0, 0, 2}}};
}

}  // namespace

const std::vector<std::string>& inverter_configurations() {
  static const std::vector<std::string> names = {"three_level", "two_level"};
  return names;
}

ModeSet inverter_modes(const std::string& configuration, const InverterParameters& p) {
  if (configuration == "three_level") return three_level(p);
  if (configuration == "two_level") return two_level(p);
  throw std::invalid_argument(fmt::format("inverter: '{}' is not known; allowed: {}", configuration,
                                          fmt::join(inverter_configurations(), ", ")));
}

}  // namespace solenoid
