#pragma once

#include "experiments/rig/node/hardware.hpp"
#include "experiments/rig/node/ports/network.hpp"

#include <array>
#include <cstdint>
#include <span>

namespace solenoid::port {

/// WIZnet's W5500 (datasheet 1.0.9) as one UDP socket: its own ARP, IPv4, ICMP and UDP take the place of Network. It
/// drops what is broken by itself. Over spi_exchange and spi_select alone.
class W5500 {
 public:
  /// Resets it and opens the socket; false: there is none on the bus.
  bool start(const MacAddress& mac, const std::array<std::uint8_t, 4>& address, const std::array<std::uint8_t, 4>& mask,
             const std::array<std::uint8_t, 4>& gateway, std::uint16_t port) noexcept;
  /// As NodeHardware::receive.
  std::size_t receive(std::span<char> room, NodePeer& from) noexcept;
  /// As NodeHardware::send; lost if the chip still sends.
  void send(std::span<const char> bytes, const NodePeer& to) noexcept;

 private:
  void read(std::uint16_t address, std::uint8_t block, std::span<char> into) noexcept;
  void write(std::uint16_t address, std::uint8_t block, std::span<const char> bytes) noexcept;
  std::uint8_t read8(std::uint16_t address, std::uint8_t block) noexcept;
  std::uint16_t read16(std::uint16_t address, std::uint8_t block) noexcept;
  void write8(std::uint16_t address, std::uint8_t block, std::uint8_t value) noexcept;
  void write16(std::uint16_t address, std::uint8_t block, std::uint16_t value) noexcept;
  void command(std::uint8_t what) noexcept;
};

}  // namespace solenoid::port
