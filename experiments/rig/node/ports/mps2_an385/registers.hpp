#pragma once

#include <cstdint>

namespace solenoid::mps2 {

/// A register of the board.
inline volatile std::uint32_t& at(std::uint32_t address) noexcept {
  return *reinterpret_cast<volatile std::uint32_t*>(address);
}

/// Of the Cortex-M3 (Arm DDI 0403, B3.2 and B3.3).
namespace cpu {
inline constexpr std::uint32_t systick_control = 0xE000E010, systick_reload = 0xE000E014, systick_current = 0xE000E018;
inline constexpr std::uint32_t interrupt_enable = 0xE000E100, interrupt_unpend = 0xE000E280;
inline constexpr std::uint32_t control_state = 0xE000ED04, reset_control = 0xE000ED0C;
inline constexpr std::uint32_t systick_on = 0x7;  ///< counts the processor's clock, and pends its exception
inline constexpr std::uint32_t unpend_systick = 1u << 25, reset_now = 0x05FA0004;
}  // namespace cpu

/// Of the board (Arm DAI 0385 and DDI 0479).
inline constexpr std::uint32_t clock_hz = 25'000'000, clock_mhz = clock_hz / 1'000'000;
inline constexpr std::uint32_t uart = 0x40004000, watchdog = 0x40008000, fpga_io = 0x40028000, ethernet = 0x40200000;
inline constexpr std::uint32_t ethernet_interrupt = 13;
inline constexpr std::uint32_t uart_data = uart, uart_state = uart + 4, uart_control = uart + 8,
                               uart_divider = uart + 16;
inline constexpr std::uint32_t watchdog_load = watchdog, watchdog_control = watchdog + 8,
                               watchdog_clear = watchdog + 12;
inline constexpr std::uint32_t counter = fpga_io + 0x18, prescale = fpga_io + 0x1c;

}  // namespace solenoid::mps2
