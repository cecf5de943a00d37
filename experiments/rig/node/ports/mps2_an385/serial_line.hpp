#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace solenoid::mps2 {

/// The board's serial line (CMSDK UART, Arm DDI 0479, 4.5): lines of text that leave when there is time, at the line's
/// speed. What the buffer has no room for is lost; nobody waits.
class SerialLine {
 public:
  void start() noexcept;
  void add(std::string_view text) noexcept;
  void add(std::uint32_t number) noexcept;
  /// Sends what the line has room for by now.
  void poll(std::uint64_t now_us) noexcept;

 private:
  std::array<char, 1024> buffer_{};
  std::uint32_t in_ = 0, out_ = 0;  // counted up; of the buffer's size, a power of two, the rest
  std::uint64_t free_us_ = 0;       // when the line has sent what it has
};

}  // namespace solenoid::mps2
