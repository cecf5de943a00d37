#pragma once

#include "experiments/rig/node/hardware.hpp"
#include "experiments/rig/node/packet.hpp"

#include <cstdint>
#include <string>

namespace solenoid {

class ModeSet;
struct SystemDescription;

/// The program's side of the node's packets (node/packet.hpp): keys from files, and volts.

/// From a file of 32 hexadecimal digits that nobody else may read. Throws ConfigError.
NodeKey read_node_key(const std::string& path);

/// What goes over the wire, in words: the system, its channels, continuous inputs and switches, in the order of samples
/// and commands. Controller and node must agree on it to the letter. Throws ConfigError if it has no room in a packet.
std::string wire_text(const SystemDescription& system, const ModeSet& modes);

/// "127.0.0.1:47811".
std::string peer_text(const NodePeer& peer);

/// A number that cannot be guessed, never 0.
std::uint64_t unguessable_number();

/// Voltages travel in whole microvolts; beyond +-2147 V, or for what is no number, as the most negative one.
std::int32_t to_microvolts(double volts) noexcept;
constexpr double from_microvolts(std::int32_t word) { return 1e-6 * word; }

/// The node's times in seconds.
inline constexpr double node_timeout_s = 1e-6 * node_timeout_us, node_command_age_s = 1e-6 * node_command_age_us,
                        node_hold_s = 1e-6 * node_hold_us;

}  // namespace solenoid
