#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace solenoid {

/// CRC-32 of ISO 3309 (zlib's, Ethernet's): polynomial 0xEDB88320 reflected, initial and final complement. The CRC of
/// "123456789" is 0xCBF43926. `crc` continues an earlier one. No allocation or exception.
std::uint32_t crc32(std::string_view bytes, std::uint32_t crc = 0) noexcept;

/// Appends integers to a buffer, least significant byte first.
template <class T>
void append_little_endian(std::string& out, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i)
    out += static_cast<char>((static_cast<std::uint64_t>(value) >> (8 * i)) & 0xffu);
}
/// Reads one from at least sizeof(T) bytes.
template <class T>
T little_endian(const char* in) noexcept {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    value |= static_cast<std::uint64_t>(static_cast<unsigned char>(in[i])) << (8 * i);
  return static_cast<T>(value);
}

}  // namespace solenoid
