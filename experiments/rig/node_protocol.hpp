#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace solenoid {

/// The packets between controller and I/O node: 52 bytes each, little-endian (docs/reference/rig.md, byte by byte).
///
///     0  u32 magic "SLN1"      4  u8 type      5  u8 flags      6  u16 zero
///     8  u32 session          12  u32 sequence                 16  u64 sender's monotonic time [us]
///    24  six 32-bit words of payload           48  u32 CRC-32 of bytes 0 to 47
///
///     open      -                  the node starts a session: safe outputs, counters 0; answers with a sample
///     request   -                  answers with a sample
///     command   coils, motor_uv    outputs until the next command; none for 20 ms: safe
///     safe      -                  safe outputs at once
///     sample    echo, position_uv, pressure_a_uv, pressure_b_uv, timeouts, refused
struct NodePacket {
  enum class Type : std::uint8_t { open = 1, request = 2, command = 3, sample = 4, safe = 5 };
  static constexpr std::size_t size = 52;
  static constexpr std::uint32_t magic = 0x314E4C53;  // "SLN1" in the packet
  static constexpr std::uint8_t flag_safe = 1;        ///< of a sample: the node's outputs are in the safe state

  Type type = Type::request;
  std::uint8_t flags = 0;
  std::uint32_t session = 0, sequence = 0;
  std::uint64_t time_us = 0;
  std::array<std::int32_t, 6> words{};

  std::array<char, size> encode() const noexcept;
  /// Nothing for a packet of another length, magic, type or checksum.
  static std::optional<NodePacket> decode(std::string_view bytes) noexcept;
};

/// Voltages travel in whole microvolts.
std::int32_t to_microvolts(double volts) noexcept;
constexpr double from_microvolts(std::int32_t word) { return 1e-6 * word; }

/// Whether `next` comes after `last`, counting modulo 2^32.
constexpr bool newer(std::uint32_t next, std::uint32_t last) { return static_cast<std::int32_t>(next - last) > 0; }

/// No valid newer command for so long: the node goes to its safe state, within 20 ms of the last one even if it looks
/// only each half millisecond.
inline constexpr double node_timeout_s = 0.0195;
inline constexpr int node_port = 47811;

}  // namespace solenoid
