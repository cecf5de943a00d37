#pragma once

#include <cstdint>

namespace solenoid::mps2 {

/// What the start-up fills the stack with.
inline constexpr std::uint32_t stack_paint = 0x5AFE5AFE;

/// The most bytes of the stack that were ever used since the board was started: those above the lowest word that is not
/// as it was painted.
std::uint32_t most_stack_used() noexcept;

}  // namespace solenoid::mps2
