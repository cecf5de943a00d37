#include "experiments/rig/node/tag.hpp"

#include "experiments/rig/node/bytes.hpp"

#include <bit>

namespace solenoid {
namespace {

/// The hash's state and its two kinds of rounds.
struct Sip {
  std::uint64_t v0, v1, v2, v3;

  void rounds(int count) noexcept {
    while (count-- > 0) {
      v0 += v1, v1 = std::rotl(v1, 13) ^ v0, v0 = std::rotl(v0, 32);
      v2 += v3, v3 = std::rotl(v3, 16) ^ v2;
      v0 += v3, v3 = std::rotl(v3, 21) ^ v0;
      v2 += v1, v1 = std::rotl(v1, 17) ^ v2, v2 = std::rotl(v2, 32);
    }
  }
  void take(std::uint64_t word) noexcept {
    v3 ^= word;
    rounds(2);
    v0 ^= word;
  }
  std::uint64_t sum() const noexcept { return v0 ^ v1 ^ v2 ^ v3; }
};

/// CRC-32 of each half byte: 64 bytes of table, two steps a byte.
constexpr std::array<std::uint32_t, 16> half_byte_crcs = [] {
  std::array<std::uint32_t, 16> table{};
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 4; ++bit) c = (c >> 1) ^ ((c & 1u) ? 0xEDB88320u : 0u);
    table[i] = c;
  }
  return table;
}();

}  // namespace

NodeTag siphash_2_4_128(std::string_view bytes, const NodeKey& key) noexcept {
  const char* const k = reinterpret_cast<const char*>(key.bytes.data());
  const auto k0 = take_little_endian<std::uint64_t>(k), k1 = take_little_endian<std::uint64_t>(k + 8);
  Sip sip{k0 ^ 0x736F6D6570736575, k1 ^ 0x646F72616E646F6D ^ 0xEE, k0 ^ 0x6C7967656E657261, k1 ^ 0x7465646279746573};
  const std::size_t whole = bytes.size() & ~std::size_t{7};
  for (std::size_t at = 0; at < whole; at += 8) sip.take(take_little_endian<std::uint64_t>(bytes.data() + at));
  std::uint64_t last = std::uint64_t{bytes.size() & 0xFF} << 56;
  for (std::size_t at = whole; at < bytes.size(); ++at)
    last |= std::uint64_t{static_cast<unsigned char>(bytes[at])} << (8 * (at - whole));
  sip.take(last);
  NodeTag tag;
  sip.v2 ^= 0xEE;
  sip.rounds(4);
  put_little_endian(tag.data(), sip.sum());
  sip.v1 ^= 0xDD;
  sip.rounds(4);
  put_little_endian(tag.data() + 8, sip.sum());
  return tag;
}

std::uint32_t node_crc32(std::string_view bytes) noexcept {
  std::uint32_t crc = 0xFFFFFFFFu;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    crc = (crc >> 4) ^ half_byte_crcs[crc & 15u];
    crc = (crc >> 4) ^ half_byte_crcs[crc & 15u];
  }
  return ~crc;
}

NodeTag node_tag(std::string_view bytes, const NodeKey* key) noexcept {
  if (key) return siphash_2_4_128(bytes, *key);
  NodeTag tag{};
  put_little_endian(tag.data(), node_crc32(bytes));
  return tag;
}

bool equal_tags(const NodeTag& tag, const char* other) noexcept {
  unsigned differ = 0;
  for (std::size_t i = 0; i < tag.size(); ++i)
    differ |= static_cast<unsigned char>(tag[i]) ^ static_cast<unsigned char>(other[i]);
  return differ == 0;
}

}  // namespace solenoid
