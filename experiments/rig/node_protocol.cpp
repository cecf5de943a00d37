#include "experiments/rig/node_protocol.hpp"

#include "core/config/reader.hpp"
#include "core/config/whole_file.hpp"
#include "core/mpc/mode_set.hpp"
#include "core/system/description.hpp"
#include "experiments/base/bytes.hpp"

#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/format.h>
#include <sodium/crypto_shorthash_siphash24.h>
#include <sodium/utils.h>
#include <sys/random.h>
#include <sys/stat.h>

namespace solenoid {
namespace {

template <class T>
void put(char* out, T value) noexcept {
  for (std::size_t i = 0; i < sizeof(T); ++i)
    out[i] = static_cast<char>((static_cast<std::uint64_t>(value) >> (8 * i)) & 0xffu);
}

using Tag = std::array<char, NodePacket::tag_size>;

Tag tag_of(std::string_view bytes, const NodeKey* key) noexcept {
  Tag tag{};
  if (key)
    crypto_shorthash_siphashx24(reinterpret_cast<unsigned char*>(tag.data()),
                                reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), key->bytes.data());
  else
    put(tag.data(), crc32(bytes));
  return tag;
}

constexpr std::size_t most_key_bytes = 64;
constexpr std::size_t word_size = 4, echo_size = 8, time_size = 8, counters = 3;
constexpr std::size_t sample_head = echo_size + counters * word_size;

}  // namespace

NodeKey read_node_key(const std::string& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0)
    throw ConfigError(
        fmt::format("{}: cannot be read: {} (allowed: a file of 32 hexadecimal digits)", path, std::strerror(errno)));
  if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    throw ConfigError(fmt::format("{}: a key that others may read is none (allowed: chmod 600)", path));
  std::string digits = read_whole_file(path, most_key_bytes).value_or("");
  while (!digits.empty() && std::isspace(static_cast<unsigned char>(digits.back()))) digits.pop_back();
  NodeKey key;
  std::size_t size = 0;
  if (sodium_hex2bin(key.bytes.data(), key.bytes.size(), digits.data(), digits.size(), nullptr, &size, nullptr) != 0 ||
      size != key.bytes.size() || digits.size() != 2 * size)
    throw ConfigError(fmt::format("{}: is no key (allowed: 32 hexadecimal digits)", path));
  return key;
}

void NodePacket::append(std::int32_t value) noexcept {
  if (length + word_size > payload.size()) return;
  put(payload.data() + length, static_cast<std::uint32_t>(value));
  length = static_cast<std::uint16_t>(length + word_size);
}

void NodePacket::append(std::uint64_t value) noexcept {
  append(static_cast<std::int32_t>(static_cast<std::uint32_t>(value)));
  append(static_cast<std::int32_t>(static_cast<std::uint32_t>(value >> 32)));
}

void NodePacket::append(std::string_view text) noexcept {
  const std::size_t size = std::min(text.size(), payload.size() - length);
  std::memcpy(payload.data() + length, text.data(), size);
  length = static_cast<std::uint16_t>(length + size);
}

std::int32_t NodePacket::word(std::size_t at) const noexcept {
  return at + word_size <= length ? static_cast<std::int32_t>(little_endian<std::uint32_t>(payload.data() + at)) : 0;
}

std::uint64_t NodePacket::number(std::size_t at) const noexcept {
  return at + echo_size <= length ? little_endian<std::uint64_t>(payload.data() + at) : 0;
}

std::string_view NodePacket::text(std::size_t at) const noexcept {
  return at < length ? std::string_view(payload.data() + at, length - at) : std::string_view();
}

std::size_t NodePacket::encode(std::span<char, most_size> out, const NodeKey* key) const noexcept {
  char* const to = out.data();
  put(to, magic);
  to[4] = static_cast<char>(type);
  to[5] = static_cast<char>(flags);
  put(to + 6, length);
  put(to + 8, session);
  put(to + 16, sequence);
  put(to + 24, time_us);
  std::memcpy(to + header_size, payload.data(), length);
  const std::size_t tagged = header_size + length;
  const Tag tag = tag_of({to, tagged}, key);
  std::memcpy(to + tagged, tag.data(), tag.size());
  return tagged + tag.size();
}

std::optional<NodePacket> NodePacket::decode(std::string_view bytes, const NodeKey* key) noexcept {
  if (bytes.size() < header_size + tag_size || bytes.size() > most_size) return std::nullopt;
  const char* const from = bytes.data();
  const auto length = little_endian<std::uint16_t>(from + 6);
  const auto type = static_cast<std::uint8_t>(from[4]);
  if (little_endian<std::uint32_t>(from) != magic || bytes.size() != header_size + length + tag_size ||
      type < static_cast<std::uint8_t>(Type::hello) || type > static_cast<std::uint8_t>(Type::close))
    return std::nullopt;
  const std::size_t tagged = header_size + length;
  const Tag tag = tag_of(bytes.substr(0, tagged), key);
  if (sodium_memcmp(tag.data(), from + tagged, tag.size()) != 0) return std::nullopt;
  NodePacket p;
  p.type = static_cast<Type>(type);
  p.flags = static_cast<std::uint8_t>(from[5]);
  p.length = length;
  p.session = little_endian<std::uint64_t>(from + 8);
  p.sequence = little_endian<std::uint64_t>(from + 16);
  p.time_us = little_endian<std::uint64_t>(from + 24);
  std::memcpy(p.payload.data(), from + header_size, length);
  return p;
}

void NodeSample::put(NodePacket& packet, std::size_t channels) const noexcept {
  packet.append(echo);
  for (const std::int32_t count : {timeouts, refused, asked}) packet.append(count);
  for (std::size_t i = 0; i < channels; ++i) packet.append(to_microvolts(volts[i]));
}

std::optional<NodeSample> NodeSample::of(const NodePacket& packet, std::size_t channels) noexcept {
  if (packet.length != sample_head + channels * word_size) return std::nullopt;
  NodeSample sample;
  sample.echo = packet.number(0);
  sample.timeouts = packet.word(echo_size);
  sample.refused = packet.word(echo_size + word_size);
  sample.asked = packet.word(echo_size + 2 * word_size);
  for (std::size_t i = 0; i < channels; ++i)
    sample.volts[i] = from_microvolts(packet.word(sample_head + i * word_size));
  return sample;
}

void NodeCommand::put(NodePacket& packet, std::size_t continuous) const noexcept {
  packet.append(static_cast<std::int32_t>(switches));
  for (std::size_t i = 0; i < continuous; ++i) packet.append(to_microvolts(volts[i]));
  packet.append(seen_us);
}

std::optional<NodeCommand> NodeCommand::of(const NodePacket& packet, std::size_t continuous) noexcept {
  if (packet.length != (1 + continuous) * word_size + time_size) return std::nullopt;
  NodeCommand command;
  command.switches = static_cast<std::uint32_t>(packet.word(0));
  for (std::size_t i = 0; i < continuous; ++i) command.volts[i] = from_microvolts(packet.word((1 + i) * word_size));
  command.seen_us = packet.number((1 + continuous) * word_size);
  return command;
}

std::string wire_text(const SystemDescription& system, const ModeSet& modes) {
  std::string text = system.name;
  const auto list = [&](const char* what, const std::vector<Signal>& signals) {
    text += fmt::format("; {}:", what);
    for (const Signal& signal : signals) text += fmt::format(" {} [{}]", signal.name, signal.unit);
  };
  list("channels", system.channels);
  list("continuous", system.continuous);
  text += "; switches:";
  for (const Switch& s : modes.switches()) text += " " + s.name;
  if (text.size() > NodePacket::most_payload - word_size)
    throw ConfigError(fmt::format("{}: its names are too long for a packet (allowed: {} characters in all)",
                                  system.name, NodePacket::most_payload - word_size));
  return text;
}

std::uint64_t unguessable_number() {
  std::uint64_t number = 0;
  while (number == 0)
    if (::getrandom(&number, sizeof number, 0) != sizeof number) number = 0;
  return number;
}

std::int32_t to_microvolts(double volts) noexcept {
  const double most = 1e-6 * std::numeric_limits<std::int32_t>::max();
  if (!(std::abs(volts) <= most)) return std::numeric_limits<std::int32_t>::min();
  return static_cast<std::int32_t>(std::lround(1e6 * volts));
}

}  // namespace solenoid
