#include "experiments/rig/node/ports/mps2_an385/lan9118.hpp"

#include "experiments/rig/node/ports/mps2_an385/registers.hpp"

#include <cstring>

namespace solenoid::mps2 {
namespace {

// Registers (section 5.3) and the MAC's own behind two of them (section 5.4).
constexpr std::uint32_t rx_data = ethernet, tx_data = ethernet + 0x20, rx_status = ethernet + 0x40,
                        tx_status = ethernet + 0x48;
constexpr std::uint32_t irq_config = ethernet + 0x54, interrupt_status = ethernet + 0x58,
                        interrupt_on = ethernet + 0x5c;
constexpr std::uint32_t byte_test = ethernet + 0x64, fifo_levels = ethernet + 0x68, rx_config = ethernet + 0x6c,
                        tx_config = ethernet + 0x70, hardware_config = ethernet + 0x74;
constexpr std::uint32_t rx_fifo = ethernet + 0x7c, tx_fifo = ethernet + 0x80;
constexpr std::uint32_t mac_command = ethernet + 0xa4, mac_data = ethernet + 0xa8;
constexpr std::uint32_t mac_control = 1, mac_high = 2, mac_low = 3;

constexpr std::uint32_t byte_test_answer = 0x87654321, busy = 1u << 31, read_it = 1u << 30;
constexpr std::uint32_t software_reset = 1, transmitter_on = 2,
                        full_duplex_receive_transmit = 1u << 20 | 1u << 3 | 1u << 2;
constexpr std::uint32_t fifo_of_8_kb_store_and_forward = 5u << 16 | 1u << 20;
constexpr std::uint32_t push_pull_active_high_on = 1u << 8 | 1u << 4 | 1u;
constexpr std::uint32_t rx_level_interrupt = 1u << 3;
constexpr std::uint32_t rx_errors = 1u << 15;
constexpr int most_looks = 10'000;
constexpr std::size_t checksum_size = 4;

bool wait_while(std::uint32_t address, std::uint32_t bits) {
  for (int i = 0; i < most_looks; ++i)
    if ((at(address) & bits) == 0) return true;
  return false;
}

std::uint32_t read_mac(std::uint32_t index) {
  wait_while(mac_command, busy);
  at(mac_command) = busy | read_it | index;
  wait_while(mac_command, busy);
  return at(mac_data);
}

void write_mac(std::uint32_t index, std::uint32_t value) {
  wait_while(mac_command, busy);
  at(mac_data) = value;
  at(mac_command) = busy | index;
  wait_while(mac_command, busy);
}

}  // namespace

bool Lan9118::start() noexcept {
  if (at(byte_test) != byte_test_answer) return false;
  at(hardware_config) = software_reset;
  if (!wait_while(hardware_config, software_reset)) return false;
  at(hardware_config) = fifo_of_8_kb_store_and_forward;
  at(interrupt_on) = 0;
  at(interrupt_status) = ~0u;
  at(irq_config) = push_pull_active_high_on;
  at(fifo_levels) = 0;  // the first frame that is there
  at(rx_config) = 0;
  at(tx_config) = transmitter_on;
  write_mac(mac_control, full_duplex_receive_transmit);  // frames to this address, and to all
  return true;
}

MacAddress Lan9118::mac() const noexcept {
  const std::uint32_t low = read_mac(mac_low), high = read_mac(mac_high);
  const auto byte = [](std::uint32_t word, int i) { return static_cast<std::uint8_t>(word >> (8 * i)); };
  return {byte(low, 0), byte(low, 1), byte(low, 2), byte(low, 3), byte(high, 0), byte(high, 1)};
}

bool Lan9118::has_frame() const noexcept { return (at(rx_fifo) & 0x00ff0000u) != 0; }

std::size_t Lan9118::receive(std::span<std::uint32_t> room) noexcept {
  if (!has_frame()) return 0;
  const std::uint32_t status = at(rx_status);
  const std::size_t size = (status >> 16) & 0x3fff, words = (size + 3) / 4;
  const bool good = (status & rx_errors) == 0 && size >= checksum_size && words <= room.size();
  for (std::size_t i = 0; i < words; ++i) {
    const std::uint32_t word = at(rx_data);
    if (good) room[i] = word;
  }
  return good ? size - checksum_size : 0;
}

void Lan9118::send(std::span<const char> frame) noexcept {
  while ((at(tx_fifo) & 0x00ff0000u) != 0) static_cast<void>(static_cast<std::uint32_t>(at(tx_status)));
  const std::uint32_t size = static_cast<std::uint32_t>(frame.size()), words = (size + 3) / 4;
  if ((at(tx_fifo) & 0xffffu) < 4 * words + 8) return;
  at(tx_data) = 1u << 13 | 1u << 12 | size;  // the frame's first and last piece
  at(tx_data) = size;
  for (std::uint32_t i = 0; i < words; ++i) {
    std::uint32_t word = 0;
    const std::uint32_t left = size - 4 * i;
    std::memcpy(&word, frame.data() + 4 * i, left < 4 ? left : 4);
    at(tx_data) = word;
  }
}

void Lan9118::wake(bool on) noexcept {
  if (on) at(interrupt_status) = rx_level_interrupt;
  at(interrupt_on) = on ? rx_level_interrupt : 0;
}

}  // namespace solenoid::mps2
