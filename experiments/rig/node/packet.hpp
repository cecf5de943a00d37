#pragma once

#include "experiments/rig/node/tag.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace solenoid {

/// The packets between controller and I/O node, version 2, little-endian (docs/reference/rig.md, byte by byte):
///
///     0  u32 magic "SLN2"      4  u8 type      5  u8 flags     6  u16 length of the payload
///     8  u64 session          16  u64 sequence                24  u64 sender's monotonic time [us]
///    32  payload               then a tag of 16 bytes over all before: SipHash-2-4 with the shared key, or without one
///                              CRC-32 and zeros
///
///     hello     wire text                       asks for a session; `session` is a number of the asker's choice
///     offer     that number                     the node has room: `session` is its random number for a new one
///     refuse    reason, text                    the node has none: another controller, another wire
///     open      number it asked with            begins the session offered: safe outputs, counters 0
///     request   sample's time                   asks for a sample
///     command   switches, volts, sample's time  outputs until the next command; none for 20 ms: safe
///     sample    echo, counters, age, volts      answers open and request
///     safe                                      safe outputs at once
///     close                                     safe outputs, and the session's end
///
/// Firmware is compiled from this header and what it includes: no heap, exceptions or floating point.
struct NodePacket {
  enum class Type : std::uint8_t { hello = 1, offer, refuse, open, request, command, sample, safe, close };
  static constexpr std::uint32_t magic = 0x324E4C53;  // "SLN2" in the packet
  static constexpr char version = '2';
  static constexpr std::size_t header_size = 32, tag_size = 16, most_payload = 1024;
  static constexpr std::size_t most_size = header_size + most_payload + tag_size;
  static constexpr std::uint8_t flag_safe = 1;  ///< of a sample: the node's outputs are in the safe state

  Type type = Type::request;
  std::uint8_t flags = 0;
  std::uint16_t length = 0;  ///< of the payload, at most most_payload
  std::uint64_t session = 0, sequence = 0, time_us = 0;
  std::array<char, most_payload> payload;  ///< the first `length` of it

  NodePacket() = default;
  explicit NodePacket(Type kind) : type(kind) {}

  /// Appends to the payload; what no longer has room is left out.
  void append(std::int32_t word) noexcept;
  void append(std::uint64_t number) noexcept;
  void append(std::string_view text) noexcept;
  /// Of the payload at an offset; 0 beyond its end.
  std::int32_t word(std::size_t at) const noexcept;
  std::uint64_t number(std::size_t at) const noexcept;
  std::string_view text(std::size_t at) const noexcept;

  /// Writes the packet with its tag; returns its size.
  std::size_t encode(std::span<char, most_size> out, const NodeKey* key) const noexcept;
  /// Nothing for a packet of another length, magic, type or tag.
  static std::optional<NodePacket> decode(std::string_view bytes, const NodeKey* key) noexcept;
  /// The same into `packet`, which is left alone unless true is returned.
  static bool decode(std::string_view bytes, const NodeKey* key, NodePacket& packet) noexcept;
};

/// Whether bytes are a packet of a type in another version of this protocol, as its first bytes say.
bool of_another_version(std::string_view bytes, NodePacket::Type type) noexcept;

/// Channels and continuous inputs that a packet may have at most.
inline constexpr std::size_t most_node_channels = 16, most_node_outputs = 16;

/// What a sample says, beside its flags.
struct NodeSample {
  std::uint64_t echo = 0;                             ///< the sequence of the packet that it answers
  std::int32_t timeouts = 0, refused = 0, asked = 0;  ///< of the session: silences, commands, other controllers
  std::int32_t age_us = 0;                            ///< how long before the packet's time the channels were measured
  std::array<std::int32_t, most_node_channels> microvolts{};

  void put(NodePacket& packet, std::size_t channels) const noexcept;
  /// Nothing if the packet has another number of channels.
  static std::optional<NodeSample> of(const NodePacket& packet, std::size_t channels) noexcept;
};

/// What a command says.
struct NodeCommand {
  std::uint32_t switches = 0;
  std::array<std::int32_t, most_node_outputs> microvolts{};
  std::uint64_t seen_us = 0;  ///< the node's time in the newest sample that the controller had: how old the command is

  void put(NodePacket& packet, std::size_t continuous) const noexcept;
  static std::optional<NodeCommand> of(const NodePacket& packet, std::size_t continuous) noexcept;
};

/// Why a node refuses.
enum class NodeRefusal : std::int32_t { busy = 1, other_wire = 2, no_session = 3, other_version = 4 };

/// No valid newer command for so long: the node goes to its safe state, within 20 ms of the last one even if it looks
/// only each half millisecond, half a millisecond late.
inline constexpr std::uint64_t node_timeout_us = 19'000;
/// A command whose controller has seen no sample for so long is none: it was held back.
inline constexpr std::uint64_t node_command_age_us = 50'000;
/// A session of which nothing was heard for so long gives way to another.
inline constexpr std::uint64_t node_hold_us = 1'000'000;
inline constexpr int node_port = 47811;

}  // namespace solenoid
