#include "experiments/rig/node/packet.hpp"

#include "experiments/rig/node/bytes.hpp"

#include <algorithm>
#include <cstring>

namespace solenoid {
namespace {

constexpr std::size_t word_size = 4, number_size = 8, counters = 4;
constexpr std::size_t sample_head = number_size + counters * word_size;

}  // namespace

void NodePacket::append(std::int32_t value) noexcept {
  if (length + word_size > payload.size()) return;
  put_little_endian(payload.data() + length, static_cast<std::uint32_t>(value));
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
  return at + word_size <= length ? static_cast<std::int32_t>(take_little_endian<std::uint32_t>(payload.data() + at))
                                  : 0;
}

std::uint64_t NodePacket::number(std::size_t at) const noexcept {
  return at + number_size <= length ? take_little_endian<std::uint64_t>(payload.data() + at) : 0;
}

std::string_view NodePacket::text(std::size_t at) const noexcept {
  return at < length ? std::string_view(payload.data() + at, length - at) : std::string_view();
}

std::size_t NodePacket::encode(std::span<char, most_size> out, const NodeKey* key) const noexcept {
  char* const to = out.data();
  put_little_endian(to, magic);
  to[4] = static_cast<char>(type);
  to[5] = static_cast<char>(flags);
  put_little_endian(to + 6, length);
  put_little_endian(to + 8, session);
  put_little_endian(to + 16, sequence);
  put_little_endian(to + 24, time_us);
  std::memcpy(to + header_size, payload.data(), length);
  const std::size_t tagged = header_size + length;
  const NodeTag tag = node_tag({to, tagged}, key);
  std::memcpy(to + tagged, tag.data(), tag.size());
  return tagged + tag.size();
}

bool NodePacket::decode(std::string_view bytes, const NodeKey* key, NodePacket& packet) noexcept {
  if (bytes.size() < header_size + tag_size || bytes.size() > most_size) return false;
  const char* const from = bytes.data();
  const auto size = take_little_endian<std::uint16_t>(from + 6);
  const auto kind = static_cast<std::uint8_t>(from[4]);
  if (take_little_endian<std::uint32_t>(from) != magic || bytes.size() != header_size + size + tag_size ||
      kind < static_cast<std::uint8_t>(Type::hello) || kind > static_cast<std::uint8_t>(Type::close))
    return false;
  const std::size_t tagged = header_size + size;
  if (!equal_tags(node_tag({from, tagged}, key), from + tagged)) return false;
  packet.type = static_cast<Type>(kind);
  packet.flags = static_cast<std::uint8_t>(from[5]);
  packet.length = size;
  packet.session = take_little_endian<std::uint64_t>(from + 8);
  packet.sequence = take_little_endian<std::uint64_t>(from + 16);
  packet.time_us = take_little_endian<std::uint64_t>(from + 24);
  std::memcpy(packet.payload.data(), from + header_size, size);
  return true;
}

std::optional<NodePacket> NodePacket::decode(std::string_view bytes, const NodeKey* key) noexcept {
  NodePacket packet;
  if (!decode(bytes, key, packet)) return std::nullopt;
  return packet;
}

bool of_another_version(std::string_view bytes, NodePacket::Type type) noexcept {
  return bytes.size() >= 5 && bytes[0] == 'S' && bytes[1] == 'L' && bytes[2] == 'N' && bytes[3] >= '1' &&
         bytes[3] <= '9' && bytes[3] != NodePacket::version && bytes[4] == static_cast<char>(type);
}

void NodeSample::put(NodePacket& packet, std::size_t channels) const noexcept {
  packet.append(echo);
  for (const std::int32_t word : {timeouts, refused, asked, age_us}) packet.append(word);
  for (std::size_t i = 0; i < channels; ++i) packet.append(microvolts[i]);
}

std::optional<NodeSample> NodeSample::of(const NodePacket& packet, std::size_t channels) noexcept {
  if (packet.length != sample_head + channels * word_size || channels > most_node_channels) return std::nullopt;
  NodeSample sample;
  sample.echo = packet.number(0);
  sample.timeouts = packet.word(number_size);
  sample.refused = packet.word(number_size + word_size);
  sample.asked = packet.word(number_size + 2 * word_size);
  sample.age_us = packet.word(number_size + 3 * word_size);
  for (std::size_t i = 0; i < channels; ++i) sample.microvolts[i] = packet.word(sample_head + i * word_size);
  return sample;
}

void NodeCommand::put(NodePacket& packet, std::size_t continuous) const noexcept {
  packet.append(static_cast<std::int32_t>(switches));
  for (std::size_t i = 0; i < continuous; ++i) packet.append(microvolts[i]);
  packet.append(seen_us);
}

std::optional<NodeCommand> NodeCommand::of(const NodePacket& packet, std::size_t continuous) noexcept {
  if (packet.length != (1 + continuous) * word_size + number_size || continuous > most_node_outputs)
    return std::nullopt;
  NodeCommand command;
  command.switches = static_cast<std::uint32_t>(packet.word(0));
  for (std::size_t i = 0; i < continuous; ++i) command.microvolts[i] = packet.word((1 + i) * word_size);
  command.seen_us = packet.number((1 + continuous) * word_size);
  return command;
}

}  // namespace solenoid
