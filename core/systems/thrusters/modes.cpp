#include "core/systems/thrusters/modes.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr SwitchPattern thrusters(int a, int b) { return (1u << a) | (1u << b); }

/// Pairs by sign: [0] negative, [1] none, [2] positive.
constexpr std::array<SwitchPattern, 3> along_x = {thrusters(2, 7), 0, thrusters(3, 6)};
constexpr std::array<SwitchPattern, 3> along_y = {thrusters(1, 4), 0, thrusters(0, 5)};
/// Torques by the thrusters that push along y, and along x.
constexpr std::array<SwitchPattern, 3> turn_by_y = {thrusters(1, 5), 0, thrusters(0, 4)};
constexpr std::array<SwitchPattern, 3> turn_by_x = {thrusters(3, 7), 0, thrusters(2, 6)};
/// All thrusters that turn so.
constexpr std::array<SwitchPattern, 3> turning = {0b10101010, 0b11111111, 0b01010101};

constexpr std::array<const char*, 3> sign = {"-", "", "+"};

/// The name of a motion, "+x -turn", or coast.
std::string name_of(std::size_t x, std::size_t y, std::size_t turn) {
  std::vector<std::string> parts;
  if (x != 1) parts.push_back(fmt::format("{}x", sign[x]));
  if (y != 1) parts.push_back(fmt::format("{}y", sign[y]));
  if (turn != 1) parts.push_back(fmt::format("{}turn", sign[turn]));
  return parts.empty() ? "coast" : fmt::format("{}", fmt::join(parts, " "));
}

/// A torque comes from the thrusters of an axis that is not pushed along; if both are, each pair gives up the one that
/// turns against it.
SwitchPattern pattern_of(std::size_t x, std::size_t y, std::size_t turn) {
  if (x != 1 && y != 1) return (along_x[x] | along_y[y]) & turning[turn];
  return along_x[x] | along_y[y] | (y == 1 ? turn_by_y[turn] : turn_by_x[turn]);
}

std::vector<Mode> axis() { return {{"coast", 0}, {"+x", along_x[2]}, {"-x", along_x[0]}}; }

std::vector<Mode> pairs() {
  std::vector<Mode> modes = axis();
  modes.insert(modes.end(), {{"+y", along_y[2]}, {"-y", along_y[0]}, {"+turn", turn_by_y[2]}, {"-turn", turn_by_y[0]}});
  return modes;
}

std::vector<Mode> single(const std::vector<Switch>& switches) {
  std::vector<Mode> modes = {{"coast", 0}};
  for (std::size_t c = 0; c < switches.size(); ++c) modes.push_back({switches[c].name, SwitchPattern{1} << c});
  return modes;
}

/// Coast comes first: of plans that cost the same, a search takes the lowest numbers.
std::vector<Mode> combined() {
  static constexpr std::size_t order[] = {1, 2, 0};
  std::vector<Mode> modes;
  for (const std::size_t turn : order)
    for (const std::size_t y : order)
      for (const std::size_t x : order) modes.push_back({name_of(x, y, turn), pattern_of(x, y, turn)});
  return modes;
}

std::vector<Switch> valves(const FreeFlyerParameters& p) {
  static constexpr const char* names[] = {"+y +turn", "-y -turn", "-x +turn", "+x -turn",
                                          "-y +turn", "+y -turn", "+x +turn", "-x -turn"};
  std::vector<Switch> switches;
  for (const char* name : names)
    switches.push_back({name, p.rise_delay_s, p.fall_delay_s, std::max(p.least_on_s, p.least_off_s)});
  return switches;
}

ModeSet of_eight(const std::string& name, const FreeFlyerParameters& p, std::vector<Mode> modes) {
  std::vector<std::vector<double>> gain(8, std::vector<double>(8, 0.0));
  for (std::size_t c = 0; c < gain.size(); ++c) gain[c][c] = 1.0;
  return {name, valves(p), std::move(modes), std::vector<double>(8, 0.0), gain};
}

}  // namespace

const std::vector<std::string>& thruster_mode_sets() {
  static const std::vector<std::string> names = {"along_x", "single", "pairs", "combined"};
  return names;
}

ModeSet thruster_modes(const std::string& name, const FreeFlyerParameters& parameters) {
  parameters.validate("thrusters");
  if (name == "along_x") return of_eight(name, parameters, axis());
  if (name == "single") return of_eight(name, parameters, single(valves(parameters)));
  if (name == "pairs") return of_eight(name, parameters, pairs());
  if (name == "combined") return of_eight(name, parameters, combined());
  throw std::invalid_argument(
      fmt::format("thrusters: '{}' is not known; allowed: {}", name, fmt::join(thruster_mode_sets(), ", ")));
}

}  // namespace solenoid
