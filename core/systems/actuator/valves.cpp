#include "core/systems/actuator/valves.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

Switch coil(std::string name, const ActuatorParameters& p) {
  return {std::move(name), p.energise_delay_s, p.deenergise_delay_s, 0.0};
}

ModeSet three_way(const ActuatorParameters& p) {
  return {"three_way",
          {coil("A", p), coil("B", p)},
          {{"exhaust A, exhaust B", 0}, {"fill A, exhaust B", 1}, {"exhaust A, fill B", 2}, {"fill A, fill B", 3}},
          {0, 1, 0, 1},
          {{1, -1, 0, 0}, {0, 0, 1, -1}}};
}

/// What a chamber does and the valves that are open for it: bit i of `fill` (`exhaust`) is its i-th fill (exhaust) valve.
struct ChamberMode {
  std::string name;
  SwitchPattern fill = 0, exhaust = 0;
};

/// Of every chamber as many 2-way valves that fill as valves that exhaust, normally closed. Coils, from bit 0: supply A,
/// exhaust A, supply B, exhaust B, of each as many as there are openings, in their order.
/// shapes   openings: the openings of a path's valves, that of the single valve being 1
///          modes: pairs of chamber modes, A and B
ModeSet bank(const char* name, const std::vector<double>& openings,
             const std::vector<std::pair<ChamberMode, ChamberMode>>& modes, const ActuatorParameters& p) {
  static constexpr const char* paths[] = {"supply A", "exhaust A", "supply B", "exhaust B"};
  const std::size_t valves = openings.size();
  std::vector<Switch> coils;
  std::vector<std::vector<double>> gain;
  for (std::size_t path = 0; path < 4; ++path)
    for (std::size_t i = 0; i < valves; ++i) {
      coils.push_back(coil(valves == 1 ? paths[path] : fmt::format("{} {}", paths[path], i + 1), p));
      gain.emplace_back(4, 0.0)[path] = openings[i];
    }
  std::vector<Mode> named;
  for (const auto& [a, b] : modes) {
    const SwitchPattern chamber_a = a.fill | (a.exhaust << valves), chamber_b = b.fill | (b.exhaust << valves);
    named.push_back({fmt::format("{} A, {} B", a.name, b.name), chamber_a | (chamber_b << (2 * valves))});
  }
  return {name, std::move(coils), std::move(named), {0, 0, 0, 0}, std::move(gain)};
}

/// Every pair of chamber modes.
std::vector<std::pair<ChamberMode, ChamberMode>> all_pairs(const std::vector<ChamberMode>& chamber) {
  std::vector<std::pair<ChamberMode, ChamberMode>> pairs;
  for (const ChamberMode& a : chamber)
    for (const ChamberMode& b : chamber) pairs.emplace_back(a, b);
  return pairs;
}

/// One valve a path: hold, fill, exhaust.
const std::vector<ChamberMode>& single_valve() {
  static const std::vector<ChamberMode> modes = {{"hold", 0, 0}, {"fill", 1, 0}, {"exhaust", 0, 1}};
  return modes;
}

/// The same with some pairs only, by number.
ModeSet two_way(const char* name, const std::vector<std::pair<std::size_t, std::size_t>>& pairs,
                const ActuatorParameters& p) {
  std::vector<std::pair<ChamberMode, ChamberMode>> modes;
  modes.reserve(pairs.size());
  for (const auto& [a, b] : pairs) modes.emplace_back(single_valve()[a], single_valve()[b]);
  return bank(name, {1.0}, modes, p);
}

/// Pulse code: the openings of a path's valves double from one to the next and sum to 1, so that every whole number k of
/// the smallest is a pattern. A chamber fills, or exhausts, with k of them, or is closed.
ModeSet pulse_code(const char* name, std::size_t valves, const ActuatorParameters& p) {
  const SwitchPattern full = (SwitchPattern{1} << valves) - 1;
  std::vector<double> openings;
  for (std::size_t i = 0; i < valves; ++i) openings.push_back(static_cast<double>(1u << i) / full);
  std::vector<ChamberMode> chamber = {{"hold", 0, 0}};
  for (SwitchPattern k = 1; k <= full; ++k) chamber.push_back({fmt::format("fill {}/{}", k, full), k, 0});
  for (SwitchPattern k = 1; k <= full; ++k) chamber.push_back({fmt::format("exhaust {}/{}", k, full), 0, k});
  return bank(name, openings, all_pairs(chamber), p);
}

/// No switch, and one mode, in which the on/off valves are shut: what opens is told by continuous inputs.
ModeSet servo() { return {"servo", {}, {{"servo", 0}}, {0, 0, 0, 0}, {}}; }

/// Two valves a path, one of them open at a time: fine motion through the small one.
ModeSet dual_orifice(const ActuatorParameters& p) {
  const std::vector<ChamberMode> chamber = {
      {"hold", 0, 0}, {"fill small", 1, 0}, {"fill large", 2, 0}, {"exhaust small", 0, 1}, {"exhaust large", 0, 2}};
  return bank("dual_orifice", {small_orifice, 1.0}, all_pairs(chamber), p);
}

}  // namespace

const std::vector<std::string>& valve_configurations() {
  static const std::vector<std::string> names = {"three_way", "two_way", "three_mode", "seven_mode", "dual_orifice",
                                                 "pcm_2",     "pcm_3",   "pcm_4",      "servo"};
  return names;
}

ModeSet valve_modes(const std::string& configuration, const ActuatorParameters& p) {
  if (configuration == "three_way") return three_way(p);
  if (configuration == "two_way")
    return two_way("two_way", {{0, 0}, {0, 1}, {0, 2}, {1, 0}, {1, 1}, {1, 2}, {2, 0}, {2, 1}, {2, 2}}, p);
  if (configuration == "three_mode") return two_way("three_mode", {{0, 0}, {1, 2}, {2, 1}}, p);
  if (configuration == "seven_mode")
    return two_way("seven_mode", {{0, 0}, {0, 1}, {0, 2}, {1, 0}, {1, 2}, {2, 0}, {2, 1}}, p);
  if (configuration == "pcm_2") return pulse_code("pcm_2", 2, p);
  if (configuration == "pcm_3") return pulse_code("pcm_3", 3, p);
  if (configuration == "pcm_4") return pulse_code("pcm_4", 4, p);
  if (configuration == "dual_orifice") return dual_orifice(p);
  if (configuration == servo_valves) return servo();
  throw std::invalid_argument(
      fmt::format("valves: '{}' is not known; allowed: {}", configuration, fmt::join(valve_configurations(), ", ")));
}

}  // namespace solenoid
