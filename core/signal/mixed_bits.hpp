#pragma once

#include <cstdint>

namespace solenoid {

/// SplitMix64's output function (Steele, Lea, Flood 2014): a permutation of 64-bit numbers under which those that follow
/// each other have nothing in common.
constexpr std::uint64_t mixed_bits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

}  // namespace solenoid
