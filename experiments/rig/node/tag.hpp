#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace solenoid {

/// A key that controller and node share: with it, packets carry a tag that nobody else can make.
struct NodeKey {
  std::array<unsigned char, 16> bytes{};
};

/// What stands at a packet's end.
using NodeTag = std::array<char, 16>;

/// SipHash-2-4 of 128 bits (Aumasson and Bernstein, INDOCRYPT 2012; its 128-bit output as in the authors' reference code).
NodeTag siphash_2_4_128(std::string_view bytes, const NodeKey& key) noexcept;

/// CRC-32 of ISO 3309, as zlib has it, from a table of 16 entries.
std::uint32_t node_crc32(std::string_view bytes) noexcept;

/// The tag of a packet's bytes: SipHash with the key, or without one CRC-32 and zeros.
NodeTag node_tag(std::string_view bytes, const NodeKey* key) noexcept;

/// Whether two tags are equal, in a time that says nothing of where they differ.
bool equal_tags(const NodeTag& tag, const char* other) noexcept;

}  // namespace solenoid
