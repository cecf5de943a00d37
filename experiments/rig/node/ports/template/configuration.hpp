#pragma once

#include "experiments/rig/node/node.hpp"
#include "experiments/rig/node/ports/network.hpp"

/// What this node is: text, calibration and addresses of one rig, to be changed for another.
namespace solenoid::port {

/// To the letter what `solenoid list wires` prints for the rig's valves.
inline constexpr std::string_view wire = "(solenoid list wires --system actuator)";

/// None: whoever is on the network can drive the rig. 16 bytes, those of the file that `run --key` is given, and kept
/// out of any repository: docs/reference/rig.md, "Keys".
inline constexpr const NodeKey* key = nullptr;

inline constexpr std::size_t channels = 3, outputs = 1;
inline constexpr std::uint32_t switches = 0b1111, safe_switches = 0;

/// microvolts at the sensor = offset + counts * scale / 2^16. A converter of 12 bits, 3.3 V, behind a divider that
/// makes 0..3.3 V of -5..5 V: 10 V / 4096 counts = 2441.4 uV a count.
inline constexpr NodeInput input{-5'000'000, 160'000'000};
/// What the amplifier may be told.
inline constexpr NodeOutput output{5'000'000, 0};

inline constexpr MacAddress mac{0x02, 0x53, 0x4C, 0x4E, 0x00, 0x01};  ///< locally administered; another for each node
inline constexpr std::array<std::uint8_t, 4> address{192, 168, 47, 2}, mask{255, 255, 255, 0}, gateway{0, 0, 0, 0};

}  // namespace solenoid::port
