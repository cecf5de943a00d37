#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// How something answered: -1 it fell, 0 it did nothing, 1 it rose; none: not to be seen.
using Answer = std::optional<int>;

/// What the sensors showed when one output was tried alone.
struct Response {
  Answer position;
  std::array<Answer, 2> pressure;  ///< A, B
  bool operator==(const Response&) const = default;
};

/// What was seen of a rig's wiring. Outputs are named as they are commanded and sensors as they are read, whatever is
/// really at the other end of their wires.
struct WiringSeen {
  bool three_way = false;  ///< a valve a chamber, which exhausts when it is off; else one to fill and one to exhaust
  Answer by_hand;          ///< of the position, when a hand moved the slide towards +y
  Answer motor;            ///< of the position, to a force towards +y
  std::array<Answer, 2> at_rest;  ///< of pressures A and B against the atmosphere, every coil off
  /// A coil alone for a moment, each from where the one before it left the chambers: supply A, exhaust A, supply B,
  /// exhaust B; of three-way valves A, B.
  std::vector<Response> coils;
};

/// A way in which a rig can be wired: everything false is as it should be.
struct Wiring {
  bool position_inverted = false, position_dead = false, motor_inverted = false, motor_dead = false;
  bool pressures_swapped = false, valves_swapped = false, no_supply = false;
  std::array<bool, 2> pressure_inverted{};  ///< the sensor that is read as A, as B
  std::array<bool, 2> pressure_dead{};      ///< likewise
  std::array<bool, 2> exchanged{};          ///< supply and exhaust of chamber A, of B
  std::array<bool, 4> dead{};               ///< coils in the order of WiringSeen::coils
  bool operator==(const Wiring&) const = default;

  int faults() const;
  /// Each fault in words; empty: none.
  std::vector<std::string> words(bool three_way) const;
};

/// What would be seen of a rig that is wired so.
WiringSeen expected_of(const Wiring& wiring, bool three_way);

/// The wirings with the fewest faults that would show what was seen; more than one: it does not tell which. At most
/// three faults are looked for; empty: no such wiring shows it.
///
/// That a slide moves with the pressure that is read tells exchanged sensors from exchanged valves; that it answers
/// motor and air alike tells an inverted position from an inverted motor.
std::vector<Wiring> explanations(const WiringSeen& seen);

/// The same in words, a line a fault; several explanations are one line.
std::vector<std::string> diagnosis(const WiringSeen& seen);

}  // namespace solenoid
