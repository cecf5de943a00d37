#include "experiments/rig/log/mcap_reader.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/bytes.hpp"
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

class Parser {
 public:
  explicit Parser(McapContents& out) : out_(out) {}

  /// Records one after the other; false once the rest cannot be read.
  bool records(std::string_view bytes, bool inside_chunk) {
    Reader reader(bytes);
    while (!reader.empty() && !ended_) {
      const auto opcode = static_cast<McapRecord>(reader.number<std::uint8_t>());
      const auto size = reader.number<std::uint64_t>();
      if (reader.cut()) return stop("cut inside a record's head");
      const std::string_view content = reader.take(size);
      // A chunk that was cut still has its first messages.
      if (reader.cut() && (opcode != McapRecord::chunk || inside_chunk)) return stop("cut inside a record");
      if (!one(opcode, content, reader.cut())) return false;
      if (reader.cut()) return stop("cut inside a chunk");
    }
    return true;
  }

 private:
  bool one(McapRecord opcode, std::string_view content, bool cut) {
    Reader r(content);
    switch (opcode) {
      case McapRecord::channel: {
        const auto id = r.number<std::uint16_t>();
        r.number<std::uint16_t>();
        out_.topics.emplace(id, r.text());
        return true;
      }
      case McapRecord::message:
        return message(r);
      case McapRecord::chunk:
        return chunk(r, cut);
      case McapRecord::metadata: {
        auto& values = out_.metadata[std::string(r.text())];
        for (Reader entries(r.text()); !entries.empty();) {
          const std::string key(entries.text());
          values[key] = std::string(entries.text());
        }
        return true;
      }
      case McapRecord::data_end:
        out_.complete = true;
        ended_ = true;
        return true;
      default:
        return true;
    }
  }
  bool message(Reader& r) {
    const auto topic = out_.topics.find(r.number<std::uint16_t>());
    r.number<std::uint32_t>();
    const auto time_ns = r.number<std::uint64_t>();
    r.number<std::uint64_t>();
    if (r.cut() || topic == out_.topics.end()) return stop("a message of no channel");
    out_.messages.push_back({topic->second, time_ns, std::string(r.rest())});
    return true;
  }
  bool chunk(Reader& r, bool cut) {
    r.number<std::uint64_t>();
    r.number<std::uint64_t>();
    r.number<std::uint64_t>();
    const auto crc = r.number<std::uint32_t>();
    if (!r.text().empty()) return stop("a compressed chunk");
    r.number<std::uint64_t>();
    if (r.cut()) return stop("cut inside a chunk's head");
    if (!cut && crc != 0 && crc32(r.rest()) != crc) return stop("a chunk with a wrong checksum");
    return records(r.rest(), true);
  }
  bool stop(const char* why) {
    if (out_.problem.empty()) out_.problem = why;
    return false;
  }

  McapContents& out_;
  bool ended_ = false;
};

}  // namespace

McapContents read_mcap(std::string_view bytes, const std::string& name) {
  if (!bytes.starts_with(mcap_magic))
    throw ConfigError(fmt::format("{}: no MCAP file (allowed: a log of `solenoid run`)", name));
  McapContents contents;
  Parser(contents).records(bytes.substr(mcap_magic.size()), false);
  if (!contents.complete && contents.problem.empty()) contents.problem = "not closed";
  return contents;
}

}  // namespace solenoid
