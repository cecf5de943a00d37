#include "experiments/rig/node/ports/template/w5500.hpp"

#include "experiments/rig/node/ports/template/to_fill_in.hpp"

#include <algorithm>

namespace solenoid::port {
namespace {

// Blocks (2.2.2) and registers (4.1, 4.2).
constexpr std::uint8_t common = 0, socket = 1, transmit = 2, receive_buffer = 3;
constexpr std::uint16_t mode = 0x00, gateway_at = 0x01, mask_at = 0x05, mac_at = 0x09, address_at = 0x0f,
                        version_at = 0x39;
constexpr std::uint16_t socket_mode = 0x00, socket_command = 0x01, socket_status = 0x03, own_port = 0x04,
                        peer_address = 0x0c, peer_port = 0x10, transmit_free = 0x20, transmit_write = 0x24,
                        received_size = 0x26, receive_read = 0x28;
constexpr std::uint8_t reset = 0x80, version = 4, udp = 0x02, open = 0x01, send_it = 0x20, received_it = 0x40,
                       open_as_udp = 0x22;
constexpr int most_looks = 1000;
constexpr std::size_t packet_header = 8;  // address, port and size before each packet in the buffer

}  // namespace

void W5500::read(std::uint16_t address, std::uint8_t block, std::span<char> into) noexcept {
  std::array<std::uint8_t, 3> head{static_cast<std::uint8_t>(address >> 8), static_cast<std::uint8_t>(address),
                                   static_cast<std::uint8_t>(block << 3)};
  to_fill_in::spi_select(true);
  to_fill_in::spi_exchange(head);
  to_fill_in::spi_exchange({reinterpret_cast<std::uint8_t*>(into.data()), into.size()});
  to_fill_in::spi_select(false);
}

void W5500::write(std::uint16_t address, std::uint8_t block, std::span<const char> bytes) noexcept {
  constexpr std::uint8_t to_write = 1u << 2;
  std::array<std::uint8_t, 3> head{static_cast<std::uint8_t>(address >> 8), static_cast<std::uint8_t>(address),
                                   static_cast<std::uint8_t>(block << 3 | to_write)};
  to_fill_in::spi_select(true);
  to_fill_in::spi_exchange(head);
  for (std::array<std::uint8_t, 32> piece; !bytes.empty();) {
    const std::size_t size = std::min(bytes.size(), piece.size());
    std::copy_n(bytes.begin(), size, piece.begin());
    to_fill_in::spi_exchange(std::span(piece).first(size));
    bytes = bytes.subspan(size);
  }
  to_fill_in::spi_select(false);
}

std::uint8_t W5500::read8(std::uint16_t address, std::uint8_t block) noexcept {
  char value = 0;
  read(address, block, {&value, 1});
  return static_cast<std::uint8_t>(value);
}

/// Sizes change while they are read: until two readings agree (4.2, Sn_RX_RSR).
std::uint16_t W5500::read16(std::uint16_t address, std::uint8_t block) noexcept {
  std::uint16_t last = 0;
  for (int i = 0; i < most_looks; ++i) {
    std::array<char, 2> bytes{};
    read(address, block, bytes);
    const auto value =
        static_cast<std::uint16_t>(static_cast<std::uint8_t>(bytes[0]) << 8 | static_cast<std::uint8_t>(bytes[1]));
    if (i > 0 && value == last) return value;
    last = value;
  }
  return 0;
}

void W5500::write8(std::uint16_t address, std::uint8_t block, std::uint8_t value) noexcept {
  const char byte = static_cast<char>(value);
  write(address, block, {&byte, 1});
}

void W5500::write16(std::uint16_t address, std::uint8_t block, std::uint16_t value) noexcept {
  const std::array<char, 2> bytes{static_cast<char>(value >> 8), static_cast<char>(value)};
  write(address, block, bytes);
}

void W5500::command(std::uint8_t what) noexcept {
  write8(socket_command, socket, what);
  for (int i = 0; i < most_looks && read8(socket_command, socket) != 0; ++i) {
  }
}

bool W5500::start(const MacAddress& mac, const std::array<std::uint8_t, 4>& address,
                  const std::array<std::uint8_t, 4>& mask, const std::array<std::uint8_t, 4>& gateway,
                  std::uint16_t port) noexcept {
  if (read8(version_at, common) != version) return false;
  write8(mode, common, reset);
  for (int i = 0; i < most_looks && (read8(mode, common) & reset) != 0; ++i) {
  }
  const auto put = [&](std::uint16_t at, std::span<const std::uint8_t> bytes) {
    write(at, common, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  };
  put(gateway_at, gateway);
  put(mask_at, mask);
  put(mac_at, mac);
  put(address_at, address);
  write8(socket_mode, socket, udp);
  write16(own_port, socket, port);
  command(open);
  return read8(socket_status, socket) == open_as_udp;
}

std::size_t W5500::receive(std::span<char> room, NodePeer& from) noexcept {
  if (read16(received_size, socket) < packet_header) return 0;
  std::uint16_t at = read16(receive_read, socket);
  std::array<char, packet_header> head;
  read(at, receive_buffer, head);
  const auto byte = [&](std::size_t i) { return std::uint32_t{static_cast<std::uint8_t>(head[i])}; };
  from = {byte(0) << 24 | byte(1) << 16 | byte(2) << 8 | byte(3), static_cast<std::uint16_t>(byte(4) << 8 | byte(5))};
  const std::uint32_t size = byte(6) << 8 | byte(7);
  const std::size_t kept = std::min<std::size_t>(size, room.size());
  at = static_cast<std::uint16_t>(at + packet_header);
  read(at, receive_buffer, room.first(kept));
  write16(receive_read, socket, static_cast<std::uint16_t>(at + size));
  command(received_it);
  return std::max<std::size_t>(kept, 1);  // an empty packet is one that is too short
}

void W5500::send(std::span<const char> bytes, const NodePeer& to) noexcept {
  if (read16(transmit_free, socket) < bytes.size()) return;
  const std::array<char, 4> address{static_cast<char>(to.address >> 24), static_cast<char>(to.address >> 16),
                                    static_cast<char>(to.address >> 8), static_cast<char>(to.address)};
  write(peer_address, socket, address);
  write16(peer_port, socket, to.port);
  const std::uint16_t at = read16(transmit_write, socket);
  write(at, transmit, bytes);
  write16(transmit_write, socket, static_cast<std::uint16_t>(at + bytes.size()));
  command(send_it);
}

}  // namespace solenoid::port
