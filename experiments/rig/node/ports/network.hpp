#pragma once

#include "experiments/rig/node/hardware.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace solenoid {

/// An Ethernet address.
using MacAddress = std::array<std::uint8_t, 6>;

/// The sum of RFC 1071 over bytes, in ones' complement; an odd byte at the end counts as if a 0 followed. Begin with 0,
/// go on with what it returned, if what came before was even; 0xffff over a whole header with its checksum: the
/// checksum is right.
std::uint32_t internet_sum(std::span<const char> bytes, std::uint32_t sum = 0) noexcept;

/// Where a node is on a network.
struct NetworkSettings {
  MacAddress mac{};
  std::uint32_t address = 0;  ///< IPv4, in the host's byte order
  std::uint16_t port = 0;     ///< of UDP
};

/// What a node needs of Ethernet, ARP (RFC 826), IPv4 (RFC 791), ICMP (RFC 792) and UDP (RFC 768), for boards whose
/// Ethernet chip has none of it: it answers who asks for its address, echoes pings, and takes and makes UDP packets of
/// one port. No fragments, options or routes, and no heap; every length is checked against the frame's, and every
/// checksum against its bytes. A node answers only whom it heard of, so it asks nobody: where a frame came from the
/// answer goes.
class Network {
 public:
  static constexpr std::size_t most_frame = 1514, headers = 14 + 20 + 8, most_payload = most_frame - headers;

  explicit Network(const NetworkSettings& settings) noexcept : at_(settings) {}

  /// What a frame is.
  struct Taken {
    std::span<const char> answer{};     ///< a frame to be sent now, in `room`
    std::span<const char> payload{};    ///< of a UDP packet for the port, in the frame
    std::optional<NodePeer> from = {};  ///< who sent it, if it is one
  };
  /// Looks at a frame. `room`: where an answer is made.
  Taken take(std::span<const char> frame, std::span<char, most_frame> room) noexcept;

  /// Makes the frame of a UDP packet to somebody who was heard of; nothing for others and for what is too long.
  std::span<const char> make(std::span<const char> payload, const NodePeer& to,
                             std::span<char, most_frame> room) noexcept;

 private:
  /// Where the newest few that were heard of are.
  struct Neighbour {
    std::uint32_t address = 0;
    MacAddress mac{};
  };
  void remember(std::uint32_t address, std::span<const char> frame) noexcept;
  std::span<const char> arp(std::span<const char> frame, std::span<char, most_frame> room) noexcept;
  std::span<const char> echo(std::span<const char> frame, std::size_t size, std::span<char, most_frame> room) noexcept;
  /// The addresses and type at a frame's beginning.
  void put_ethernet(std::span<char, most_frame> room, std::span<const char, 6> to, std::uint16_t type) noexcept;
  /// The IPv4 header of a packet with so many bytes after it.
  void put_ipv4(std::span<char, most_frame> room, std::size_t payload, std::uint8_t protocol,
                std::uint32_t to) noexcept;

  NetworkSettings at_;
  std::array<Neighbour, 4> neighbours_{};
  std::uint32_t next_neighbour_ = 0;
  std::uint16_t identification_ = 0;
};

}  // namespace solenoid
