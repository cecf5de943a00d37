#include "experiments/rig/node_protocol.hpp"

#include "experiments/base/bytes.hpp"

#include <cmath>
#include <cstring>

namespace solenoid {
namespace {

template <class T>
void put(char* out, T value) noexcept {
  for (std::size_t i = 0; i < sizeof(T); ++i)
    out[i] = static_cast<char>((static_cast<std::uint64_t>(value) >> (8 * i)) & 0xffu);
}

constexpr std::size_t payload_at = 24, crc_at = 48;

}  // namespace

std::int32_t to_microvolts(double volts) noexcept { return static_cast<std::int32_t>(std::lround(1e6 * volts)); }

std::array<char, NodePacket::size> NodePacket::encode() const noexcept {
  std::array<char, size> bytes{};
  put(bytes.data(), magic);
  bytes[4] = static_cast<char>(type);
  bytes[5] = static_cast<char>(flags);
  put(bytes.data() + 8, session);
  put(bytes.data() + 12, sequence);
  put(bytes.data() + 16, time_us);
  for (std::size_t i = 0; i < words.size(); ++i)
    put(bytes.data() + payload_at + 4 * i, static_cast<std::uint32_t>(words[i]));
  put(bytes.data() + crc_at, crc32({bytes.data(), crc_at}));
  return bytes;
}

std::optional<NodePacket> NodePacket::decode(std::string_view bytes) noexcept {
  if (bytes.size() != size || little_endian<std::uint32_t>(bytes.data()) != magic) return std::nullopt;
  if (little_endian<std::uint32_t>(bytes.data() + crc_at) != crc32(bytes.substr(0, crc_at))) return std::nullopt;
  const auto type = static_cast<std::uint8_t>(bytes[4]);
  if (type < 1 || type > 5) return std::nullopt;
  NodePacket p;
  p.type = static_cast<Type>(type);
  p.flags = static_cast<std::uint8_t>(bytes[5]);
  p.session = little_endian<std::uint32_t>(bytes.data() + 8);
  p.sequence = little_endian<std::uint32_t>(bytes.data() + 12);
  p.time_us = little_endian<std::uint64_t>(bytes.data() + 16);
  for (std::size_t i = 0; i < p.words.size(); ++i)
    p.words[i] = static_cast<std::int32_t>(little_endian<std::uint32_t>(bytes.data() + payload_at + 4 * i));
  return p;
}

}  // namespace solenoid
