#pragma once

#include "experiments/rig/node/hardware.hpp"
#include "experiments/rig/node/ports/mps2_an385/board_memory.hpp"
#include "experiments/rig/node/ports/mps2_an385/configuration.hpp"
#include "experiments/rig/node/ports/mps2_an385/lan9118.hpp"
#include "experiments/rig/node/ports/mps2_an385/serial_line.hpp"
#include "experiments/rig/node/ports/network.hpp"

#include <array>
#include <cstdint>

namespace solenoid::mps2 {

/// The shared memory of the board.
inline volatile BoardMemory& memory() noexcept {
  return *reinterpret_cast<volatile BoardMemory*>(BoardMemory::address);
}

/// Sets every output to what the description calls safe: with nothing but that memory, so that a start-up and a fault
/// can do it before and after all else.
void make_outputs_safe() noexcept;

/// What the watchdog's first expiry does: safe outputs, and a reset.
[[noreturn]] void watchdog_bites() noexcept;
/// What a fault of the processor does: likewise.
[[noreturn]] void processor_fails() noexcept;

/// QEMU's mps2-an385 as a node's board: a Cortex-M3 of 25 MHz, an Ethernet chip, a serial line, a watchdog, and the
/// shared memory for converters and outputs. No interrupt is ever taken but the watchdog's: those of the timer and the
/// Ethernet chip only end the processor's rest.
class Board final : public NodeHardware {
 public:
  /// Starts clock, watchdog, serial line and network.
  void start() noexcept;
  /// Writes down what the node and its board have seen, if it is time.
  void report(const Node& node) noexcept;

  std::uint64_t now_us() noexcept override;
  std::uint64_t random() noexcept override;
  std::size_t receive(std::span<char> room, NodePeer& from) noexcept override;
  void send(std::span<const char> bytes, const NodePeer& to) noexcept override;
  void convert(std::span<std::int32_t> counts) noexcept override;
  void set_switches(std::uint32_t pattern) noexcept override;
  void set_output(std::size_t index, std::int32_t microvolts) noexcept override;
  void kick_watchdog() noexcept override;
  void wait(std::uint32_t microseconds) noexcept override;
  void tell(NodeEvent event, const NodePeer& peer) noexcept override;

 private:
  void stand_still(std::uint32_t microseconds) noexcept;

  Lan9118 chip_;
  Network network_{{}};
  SerialLine line_;
  std::uint32_t counted_ = 0, wraps_ = 0;  // of the microsecond counter
  std::uint64_t fed_us_ = 0, report_due_us_ = 0;
  std::array<std::uint32_t, (Network::most_frame + 4 + 3) / 4> frame_{};  // and its checksum
  std::array<char, Network::most_frame> answer_{};
};

}  // namespace solenoid::mps2
