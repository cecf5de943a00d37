#pragma once

#include "experiments/rig/node/ports/network.hpp"

#include <cstdint>
#include <span>

namespace solenoid::mps2 {

/// The board's Ethernet chip, LAN9118 or its like (SMSC LAN9118 datasheet, revision 1.5), polled; its interrupt only
/// wakes the processor. Every wait for the chip ends after a while.
class Lan9118 {
 public:
  /// Resets it and switches it on; false: it does not answer.
  bool start() noexcept;
  /// The address that its EEPROM gave it.
  MacAddress mac() const noexcept;

  /// The next frame's bytes into `room`; how many. 0: none has come, or one that is broken or too long, and is
  /// dropped.
  std::size_t receive(std::span<std::uint32_t> room) noexcept;
  /// Sends a frame, or drops it if the chip has no room.
  void send(std::span<const char> frame) noexcept;

  bool has_frame() const noexcept;
  /// Whether a frame that comes pends the chip's interrupt.
  void wake(bool on) noexcept;
};

}  // namespace solenoid::mps2
