#include "experiments/rig/log/mcap_writer.hpp"

#include "experiments/base/bytes.hpp"

#include <algorithm>

namespace solenoid {
namespace {

void append_text(std::string& out, std::string_view text) {
  append_little_endian(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

/// A map or array: its length in bytes, then its entries.
void append_sized(std::string& out, const std::string& entries) { append_text(out, entries); }

std::string record(McapRecord opcode, std::string_view content) {
  std::string out(1, static_cast<char>(opcode));
  append_little_endian(out, static_cast<std::uint64_t>(content.size()));
  out += content;
  return out;
}

std::string text_map(const std::map<std::string, std::string>& values) {
  std::string entries;
  for (const auto& [key, value] : values) {
    append_text(entries, key);
    append_text(entries, value);
  }
  return entries;
}

}  // namespace

McapWriter::McapWriter(Sink sink, const std::string& library) : sink_(std::move(sink)) {
  put(mcap_magic);
  std::string header;
  append_text(header, "");
  append_text(header, library);
  put(record(McapRecord::header, header));
}

void McapWriter::put(std::string_view bytes) {
  data_crc_ = crc32(bytes, data_crc_);
  offset_ += bytes.size();
  sink_(bytes);
}

std::uint16_t McapWriter::add_channel(const std::string& topic, const std::string& schema_name,
                                      const std::string& json_schema) {
  Channel channel{static_cast<std::uint16_t>(channels_.size() + 1), {}, {}, 0, 0, {}};
  std::string schema, description;
  append_little_endian(schema, channel.id);
  append_text(schema, schema_name);
  append_text(schema, "jsonschema");
  append_text(schema, json_schema);
  append_little_endian(description, channel.id);
  append_little_endian(description, channel.id);
  append_text(description, topic);
  append_text(description, "json");
  append_sized(description, "");
  channel.schema_record = record(McapRecord::schema, schema);
  channel.channel_record = record(McapRecord::channel, description);
  put(channel.schema_record);
  put(channel.channel_record);
  channels_.push_back(std::move(channel));
  return channels_.back().id;
}

void McapWriter::write_metadata(const std::string& name, const std::map<std::string, std::string>& values) {
  std::string content;
  append_text(content, name);
  append_sized(content, text_map(values));
  const std::string bytes = record(McapRecord::metadata, content);
  metadata_.push_back({offset_, bytes.size(), name});
  put(bytes);
}

void McapWriter::write(std::uint16_t id, std::uint64_t time_ns, std::string_view json) {
  Channel& channel = channels_.at(id - 1u);
  channel.index.emplace_back(time_ns, chunk_.size());
  chunk_ += static_cast<char>(McapRecord::message);
  append_little_endian(chunk_, static_cast<std::uint64_t>(2 + 4 + 8 + 8 + json.size()));
  append_little_endian(chunk_, id);
  append_little_endian(chunk_, channel.sequence++);
  append_little_endian(chunk_, time_ns);
  append_little_endian(chunk_, time_ns);
  chunk_ += json;
  const bool first = chunk_from_ns_ == 0 && chunk_to_ns_ == 0;
  chunk_from_ns_ = first ? time_ns : std::min(chunk_from_ns_, time_ns);
  chunk_to_ns_ = std::max(chunk_to_ns_, time_ns);
  first_ns_ = messages_ == 0 ? time_ns : std::min(first_ns_, time_ns);
  last_ns_ = std::max(last_ns_, time_ns);
  ++channel.messages;
  ++messages_;
}

void McapWriter::flush() {
  if (chunk_.empty()) return;
  std::string content;
  append_little_endian(content, chunk_from_ns_);
  append_little_endian(content, chunk_to_ns_);
  append_little_endian(content, static_cast<std::uint64_t>(chunk_.size()));
  append_little_endian(content, crc32(chunk_));
  append_text(content, "");
  append_little_endian(content, static_cast<std::uint64_t>(chunk_.size()));
  content += chunk_;
  const std::string bytes = record(McapRecord::chunk, content);
  ChunkIndex index{chunk_from_ns_, chunk_to_ns_, offset_, bytes.size(), chunk_.size(), 0, {}};
  put(bytes);
  const std::uint64_t indices_from = offset_;
  for (Channel& channel : channels_) {
    if (channel.index.empty()) continue;
    std::string entries, message_index;
    for (const auto& [time_ns, at] : channel.index) {
      append_little_endian(entries, time_ns);
      append_little_endian(entries, at);
    }
    append_little_endian(message_index, channel.id);
    append_sized(message_index, entries);
    index.message_index_offsets[channel.id] = offset_;
    put(record(McapRecord::message_index, message_index));
    channel.index.clear();
  }
  index.index_length = offset_ - indices_from;
  chunks_.push_back(std::move(index));
  chunk_.clear();
  chunk_from_ns_ = chunk_to_ns_ = 0;
}

std::string McapWriter::statistics() const {
  std::string content, counts;
  append_little_endian(content, messages_);
  append_little_endian(content, static_cast<std::uint16_t>(channels_.size()));
  append_little_endian(content, static_cast<std::uint32_t>(channels_.size()));
  append_little_endian(content, std::uint32_t{0});
  append_little_endian(content, static_cast<std::uint32_t>(metadata_.size()));
  append_little_endian(content, static_cast<std::uint32_t>(chunks_.size()));
  append_little_endian(content, first_ns_);
  append_little_endian(content, last_ns_);
  for (const Channel& channel : channels_) {
    append_little_endian(counts, channel.id);
    append_little_endian(counts, channel.messages);
  }
  append_sized(content, counts);
  return record(McapRecord::statistics, content);
}

/// The groups of the summary, then an offset record for each.
std::string McapWriter::summary(std::uint64_t start) const {
  std::string out, offsets;
  const auto group = [&](McapRecord opcode, const auto& items, auto record_of) {
    const std::uint64_t from = out.size();
    for (const auto& item : items) out += record_of(item);
    if (out.size() == from) return;
    std::string content(1, static_cast<char>(opcode));
    append_little_endian(content, start + from);
    append_little_endian(content, static_cast<std::uint64_t>(out.size() - from));
    offsets += record(McapRecord::summary_offset, content);
  };
  group(McapRecord::schema, channels_, [](const Channel& c) { return c.schema_record; });
  group(McapRecord::channel, channels_, [](const Channel& c) { return c.channel_record; });
  group(McapRecord::statistics, std::vector<int>{0}, [this](int) { return statistics(); });
  group(McapRecord::chunk_index, chunks_, [](const ChunkIndex& c) {
    std::string content, map;
    for (const std::uint64_t value : {c.from_ns, c.to_ns, c.offset, c.length}) append_little_endian(content, value);
    for (const auto& [id, at] : c.message_index_offsets) {
      append_little_endian(map, id);
      append_little_endian(map, at);
    }
    append_sized(content, map);
    append_little_endian(content, c.index_length);
    append_text(content, "");
    append_little_endian(content, c.size);
    append_little_endian(content, c.size);
    return record(McapRecord::chunk_index, content);
  });
  group(McapRecord::metadata_index, metadata_, [](const MetadataIndex& m) {
    std::string content;
    append_little_endian(content, m.offset);
    append_little_endian(content, m.length);
    append_text(content, m.name);
    return record(McapRecord::metadata_index, content);
  });
  return out + offsets;
}

void McapWriter::close() {
  flush();
  std::string data_end;
  append_little_endian(data_end, data_crc_);
  put(record(McapRecord::data_end, data_end));
  const std::uint64_t start = offset_;
  std::string tail = summary(start);
  std::uint64_t offsets_from = start;
  for (std::size_t at = 0; at < tail.size();) {
    if (static_cast<McapRecord>(tail[at]) == McapRecord::summary_offset) break;
    at += 9 + little_endian<std::uint64_t>(tail.data() + at + 1);
    offsets_from = start + at;
  }
  // The footer's own checksum covers the summary and the footer up to the checksum.
  tail += static_cast<char>(McapRecord::footer);
  append_little_endian(tail, std::uint64_t{20});
  append_little_endian(tail, start);
  append_little_endian(tail, offsets_from);
  append_little_endian(tail, crc32(tail));
  put(tail);
  put(mcap_magic);
}

}  // namespace solenoid
