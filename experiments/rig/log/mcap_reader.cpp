#include "experiments/rig/log/mcap_reader.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/bytes.hpp"
#include "experiments/base/shown_text.hpp"
#include "experiments/rig/log/mcap_compression.hpp"
#include "experiments/rig/log/mcap_writer.hpp"

#include <fmt/format.h>

namespace solenoid {
namespace {

/// The rest of a buffer, read from its front; short buffers set `cut` and give zeros.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}
  template <class T>
  T number() {
    const std::string_view b = take(sizeof(T));
    return cut_ ? T{} : little_endian<T>(b.data());
  }
  std::string_view text() { return take(number<std::uint32_t>()); }
  std::string_view take(std::uint64_t size) {
    if (size > rest_.size()) {
      cut_ = true;
      size = rest_.size();
    }
    const std::string_view front = rest_.substr(0, static_cast<std::size_t>(size));
    rest_.remove_prefix(static_cast<std::size_t>(size));
    return front;
  }
  std::string_view rest() const { return rest_; }
  bool empty() const { return rest_.empty(); }
  bool cut() const { return cut_; }

 private:
  std::string_view rest_;
  bool cut_ = false;
};

/// Where a record begins.
struct Place {
  std::uint64_t at = 0, chunk_at = 0;
  std::string text() const {
    return chunk_at == 0 ? fmt::format("byte {}", at) : fmt::format("byte {} of the chunk at byte {}", at, chunk_at);
  }
};

class Parser {
 public:
  Parser(std::string_view file, const std::string& name, const TakeMessage& take, McapContents& out)
      : file_(file), name_(name), take_(take), out_(out) {}

  /// Records one after the other, of the file or of a chunk (then `chunk_at` is where that begins); false once the rest
  /// cannot be read.
  bool records(std::string_view bytes, std::uint64_t from, std::uint64_t chunk_at) {
    Reader reader(bytes);
    while (!reader.empty() && !ended_) {
      const Place place{from + (bytes.size() - reader.rest().size()), chunk_at};
      const auto opcode = static_cast<McapRecord>(reader.number<std::uint8_t>());
      const auto size = reader.number<std::uint64_t>();
      if (reader.cut()) return stop("cut inside a record's head", place);
      const std::string_view content = reader.take(size);
      // A chunk that was cut still has its first messages.
      if (reader.cut() && (opcode != McapRecord::chunk || chunk_at != 0)) return stop("cut inside a record", place);
      if (!one(opcode, content, reader.cut(), place)) return false;
      if (reader.cut()) return stop("cut inside a chunk", place);
    }
    return true;
  }

 private:
  bool one(McapRecord opcode, std::string_view content, bool cut, const Place& place) {
    Reader r(content);
    const bool in_chunk = place.chunk_at != 0;
    if (opcode == McapRecord{}) return stop("no record of MCAP", place);
    switch (opcode) {
      case McapRecord::schema:
        return schema(r, place);
      case McapRecord::channel:
        return channel(r, place);
      case McapRecord::message:
        return message(r, place);
      default:
        if (!in_chunk) return outside_chunks(opcode, r, cut, place);
        refuse(place, opcode == McapRecord::chunk ? "a chunk in a chunk" : "a record that no chunk has",
               "schemas, channels and messages in a chunk");
    }
  }
  bool outside_chunks(McapRecord opcode, Reader& r, bool cut, const Place& place) {
    switch (opcode) {
      case McapRecord::chunk:
        return chunk(r, cut, place);
      case McapRecord::metadata:
        return metadata(r, place);
      case McapRecord::data_end:
        return data_end(r, place);
      case McapRecord::footer:
        return footer(place, r.rest().size());
      default:
        return true;  // attachments, indices, records of later versions
    }
  }

  bool schema(Reader& r, const Place& place) {
    const auto id = r.number<std::uint16_t>();
    const std::string_view name = r.text();
    if (r.cut()) return stop("a schema with less than it says", place);
    if (schemas_.size() >= mcap_bounds::schemas)
      refuse(place, "another schema", fmt::format("at most {}", mcap_bounds::schemas));
    schemas_.emplace(id, name);
    return true;
  }
  bool channel(Reader& r, const Place& place) {
    const auto id = r.number<std::uint16_t>();
    const auto of = r.number<std::uint16_t>();
    const std::string_view topic = r.text(), encoding = r.text();
    if (r.cut()) return stop("a channel with less than it says", place);
    if (out_.channels.size() >= mcap_bounds::channels)
      refuse(place, "another channel", fmt::format("at most {}", mcap_bounds::channels));
    const auto schema = schemas_.find(of);
    const auto [known, is_new] =
        out_.channels.emplace(id, McapChannel{std::string(topic), std::string(encoding),
                                              schema == schemas_.end() ? std::string() : schema->second});
    if (!is_new && (known->second.topic != topic || known->second.encoding != encoding))
      refuse(place, fmt::format("channel {} a second time, and another", id), "one channel a number");
    return true;
  }
  bool message(Reader& r, const Place& place) {
    const auto channel = out_.channels.find(r.number<std::uint16_t>());
    r.number<std::uint32_t>();
    const auto time_ns = r.number<std::uint64_t>();
    r.number<std::uint64_t>();
    if (r.cut() || channel == out_.channels.end()) return stop("a message of no channel", place);
    take_({channel->second, time_ns, r.rest(), place.at, place.chunk_at}, out_);
    return true;
  }
  bool metadata(Reader& r, const Place& place) {
    const auto count = [&] {
      if (++metadata_ > mcap_bounds::metadata)
        refuse(place, "more metadata", fmt::format("at most {} records and entries", mcap_bounds::metadata));
    };
    count();
    auto& values = out_.metadata[std::string(r.text())];
    Reader entries(r.text());
    while (!entries.empty()) {
      count();
      const std::string key(entries.text());
      values[key] = std::string(entries.text());
    }
    return r.cut() || entries.cut() ? stop("metadata with less than it says", place) : true;
  }

  bool chunk(Reader& r, bool cut, const Place& place) {
    r.number<std::uint64_t>();
    r.number<std::uint64_t>();
    const auto size = r.number<std::uint64_t>();
    const auto crc = r.number<std::uint32_t>();
    const std::string_view compression = r.text();
    const auto stored = r.number<std::uint64_t>();
    if (r.cut()) return stop("cut inside a chunk's head", place);
    if (!compression.empty() && !is_compression(compression))
      refuse(place, fmt::format("a chunk compressed with {}", shown(compression)), "none, zstd, lz4");
    if (size > mcap_bounds::chunk_bytes)
      refuse(place, fmt::format("a chunk of {} bytes", size), fmt::format("at most {}", mcap_bounds::chunk_bytes));
    chunk_bytes_ += size;
    const std::uint64_t most = mcap_bounds::all_bytes + mcap_bounds::expansion * file_.size();
    if (chunk_bytes_ > most)
      refuse(place, fmt::format("chunks of {} bytes together", chunk_bytes_), fmt::format("at most {}", most));
    const std::string_view body = r.take(stored);
    if (!cut && r.cut()) return stop("a chunk with less than it says", place);
    if (compression.empty()) return contents_of(body, crc != 0 || body.size() == size, crc, cut, place);
    const Decompressed plain = decompress(compression, body, static_cast<std::size_t>(size));
    if (!plain.problem.empty()) return stop(fmt::format("a damaged chunk ({}: {})", compression, plain.problem), place);
    return contents_of(plain.bytes, plain.whole && plain.bytes.size() == size, crc, cut, place);
  }
  bool contents_of(std::string_view plain, bool whole, std::uint32_t crc, bool cut, const Place& place) {
    if (!cut && !whole) return stop("a chunk of another size than it says", place);
    if (!cut && crc != 0 && crc32(plain) != crc) return stop("a chunk with a wrong checksum", place);
    return records(plain, 0, place.at);
  }

  bool data_end(Reader& r, const Place& place) {
    const auto crc = r.number<std::uint32_t>();
    if (r.cut()) return stop("cut inside a record", place);
    if (crc != 0 && crc != crc32(file_.substr(0, static_cast<std::size_t>(place.at))))
      return stop("its data have another checksum than the one at their end: it was changed since it was written",
                  place);
    out_.complete = true;
    return true;
  }
  /// Behind the footer stands the magic again, and nothing else.
  bool footer(const Place& place, std::size_t size) {
    ended_ = true;
    const std::uint64_t end = place.at + 9 + size + mcap_magic.size();
    if (end < file_.size()) stop("more behind its end, which is not read", {end, 0});
    return true;
  }

  bool stop(const std::string& why, const Place& place) {
    if (out_.problem.empty())
      out_.problem = out_.complete && !ended_ ? "cut behind its messages, which are all there"
                                              : fmt::format("{}: {}", place.text(), why);
    return false;
  }
  [[noreturn]] void refuse(const Place& place, const std::string& what, const std::string& allowed) const {
    throw ConfigError(fmt::format("{}: {}: {} (allowed: {})", name_, place.text(), what, allowed));
  }

  std::string_view file_;
  const std::string& name_;
  const TakeMessage& take_;
  McapContents& out_;
  std::map<std::uint16_t, std::string> schemas_;
  std::uint64_t chunk_bytes_ = 0;
  std::size_t metadata_ = 0;
  bool ended_ = false;
};

}  // namespace

std::string McapChannel::text() const {
  return fmt::format("channel {} is {}{}", shown(topic), shown(encoding), schema.empty() ? "" : " of " + shown(schema));
}

std::string McapMessage::where() const { return Place{at, chunk_at}.text(); }

McapContents read_mcap(std::string_view bytes, const std::string& name, const TakeMessage& take) {
  if (!bytes.starts_with(mcap_magic))
    throw ConfigError(fmt::format("{}: no MCAP file (allowed: a log of `solenoid run`)", name));
  McapContents contents;
  Parser(bytes, name, take, contents).records(bytes.substr(mcap_magic.size()), mcap_magic.size(), 0);
  if (!contents.complete && contents.problem.empty()) contents.problem = "not closed";
  return contents;
}

}  // namespace solenoid
