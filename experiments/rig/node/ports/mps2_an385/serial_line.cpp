#include "experiments/rig/node/ports/mps2_an385/serial_line.hpp"

#include "experiments/rig/node/ports/mps2_an385/configuration.hpp"
#include "experiments/rig/node/ports/mps2_an385/registers.hpp"

namespace solenoid::mps2 {
namespace {

constexpr std::uint32_t character_us = 10 * 1'000'000 / baud_rate;  // of ten bits
constexpr std::uint32_t transmitter_on = 1, full = 1;

}  // namespace

void SerialLine::start() noexcept {
  at(uart_divider) = clock_hz / baud_rate;
  at(uart_control) = transmitter_on;
}

void SerialLine::add(std::string_view text) noexcept {
  for (const char c : text)
    if (in_ - out_ < buffer_.size()) buffer_[in_++ % buffer_.size()] = c;
}

void SerialLine::add(std::uint32_t number) noexcept {
  std::array<char, 10> digits;
  std::size_t first = digits.size();
  do digits[--first] = static_cast<char>('0' + number % 10);
  while ((number /= 10) != 0);
  add(std::string_view(digits.data() + first, digits.size() - first));
}

void SerialLine::poll(std::uint64_t now_us) noexcept {
  constexpr std::uint64_t burst_us = 32 * character_us;  // after a silence
  if (free_us_ + burst_us < now_us) free_us_ = now_us - burst_us;
  while (out_ != in_ && free_us_ <= now_us && (at(uart_state) & full) == 0) {
    at(uart_data) = static_cast<unsigned char>(buffer_[out_++ % buffer_.size()]);
    free_us_ += character_us;
  }
}

}  // namespace solenoid::mps2
