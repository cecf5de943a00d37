#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

/// What a port has to write: the chip's own functions under board.cpp, with where to look for each in the reference
/// manuals of an STM32F4 (ST RM0090) and of an RP2040 (Raspberry Pi, RP2040 datasheet). Nothing here is called from an
/// interrupt, and none may wait longer than its comment says.
namespace solenoid::to_fill_in {

/// Clocks, pins with the outputs safe FIRST, the converter, the SPI bus at 10 MHz or more, and the independent watchdog
/// at 20 ms. STM32: RCC, GPIO (8), ADC (13), SPI (28), IWDG (21): prescaler 4, reload 159 at 32 kHz.
/// RP2040: 2.15, 2.19, 4.9, 4.4 and WATCHDOG (4.7) with 20 ms.
void start();

/// A counter of microseconds that wraps at 2^32. STM32: TIM2 or TIM5, 32 bits, prescaler to 1 MHz (18). RP2040:
/// TIMERAWL (4.6).
std::uint32_t microseconds();

/// 32 bits of the generator of true random numbers, its health checked; waits at most 1 ms. STM32: RNG (24), again
/// while SECS or CECS are set. RP2040: ROSC RANDOMBIT (2.17), of which each 32 samples are worth one bit, through a
/// hash.
std::uint32_t true_random();

/// One conversion of every channel, in the order of the wire text, in counts. STM32: ADC1 by scan and DMA; RP2040: ADC
/// by round robin; better an external converter of 16 bits on the SPI bus. At most 20 us.
void convert(std::span<std::int32_t> counts);

/// All switches at once: bit s is switch s. STM32: one write of GPIOx_BSRR. RP2040: SIO GPIO_OUT_SET and GPIO_OUT_CLR
/// (2.3.1).
void set_switches(std::uint32_t pattern);

/// A continuous output. A converter of 12 bits behind an amplifier of +-5 V; at most 20 us.
void set_output(std::size_t index, std::int32_t microvolts);

/// The watchdog's one word. STM32: 0xAAAA to IWDG_KR. RP2040: WATCHDOG LOAD.
void feed_watchdog();

/// Until an interrupt is pending, at most so long: a timer's, or that of the W5500's INT pin. WFI with interrupts
/// masked, so that what pends in between is not slept through.
void rest(std::uint32_t microseconds);

/// Exchanges bytes over the SPI bus: sends each and has what came in its place. At most 10 us and the bytes' own time.
void spi_exchange(std::span<std::uint8_t> bytes);
/// The W5500's chip select; on: low.
void spi_select(bool on);

/// A lamp or a line of text; returns at once.
void tell(std::uint8_t event);

}  // namespace solenoid::to_fill_in
