#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace solenoid {

/// Writes a number's bytes, the lowest first.
template <class T>
constexpr void put_little_endian(char* out, T value) noexcept {
  for (std::size_t i = 0; i < sizeof(T); ++i)
    out[i] = static_cast<char>((static_cast<std::uint64_t>(value) >> (8 * i)) & 0xffu);
}

/// Reads a number whose lowest byte comes first.
template <class T>
T take_little_endian(const char* from) noexcept {
  if constexpr (std::endian::native == std::endian::little) {
    T whole;
    std::memcpy(&whole, from, sizeof whole);
    return whole;
  }
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) value |= std::uint64_t{static_cast<unsigned char>(from[i])} << (8 * i);
  return static_cast<T>(value);
}

}  // namespace solenoid
