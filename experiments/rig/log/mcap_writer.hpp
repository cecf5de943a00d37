#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// Opcodes of the MCAP container (mcap.dev/spec, version 0).
enum class McapRecord : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0B,
  metadata = 0x0C,
  metadata_index = 0x0D,
  summary_offset = 0x0E,
  data_end = 0x0F,
};
inline constexpr std::string_view mcap_magic{"\x89MCAP0\r\n", 8};

/// Writes an MCAP file of JSON messages: uncompressed chunks with CRC and index, schemas and channels repeated in a
/// summary with chunk index and statistics at the end. Closed or cut, it can be read from the front: each flushed chunk
/// stands for itself.
///
/// Bytes go to `sink` in order. Not for a real-time thread.
class McapWriter {
 public:
  using Sink = std::function<void(std::string_view)>;

  explicit McapWriter(Sink sink, const std::string& library);

  /// A topic of JSON messages of this JSON schema; before its first message. Returns its channel.
  std::uint16_t add_channel(const std::string& topic, const std::string& schema_name, const std::string& json_schema);
  void write_metadata(const std::string& name, const std::map<std::string, std::string>& values);
  void write(std::uint16_t channel, std::uint64_t time_ns, std::string_view json);
  /// Ends the open chunk and hands it to the sink.
  void flush();
  /// Flushes and writes index and footer. Nothing may follow.
  void close();

  std::size_t open_chunk_bytes() const { return chunk_.size(); }

 private:
  struct Channel {
    std::uint16_t id;
    std::string schema_record, channel_record;
    std::uint32_t sequence = 0;
    std::uint64_t messages = 0;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> index;  // of the open chunk: time, offset
  };
  struct ChunkIndex {
    std::uint64_t from_ns, to_ns, offset, length, size, index_length;
    std::map<std::uint16_t, std::uint64_t> message_index_offsets;
  };
  struct MetadataIndex {
    std::uint64_t offset, length;
    std::string name;
  };

  void put(std::string_view bytes);
  std::string statistics() const;
  std::string summary(std::uint64_t start) const;

  Sink sink_;
  std::uint64_t offset_ = 0;
  std::uint32_t data_crc_ = 0;
  std::string chunk_;
  std::uint64_t chunk_from_ns_ = 0, chunk_to_ns_ = 0, first_ns_ = 0, last_ns_ = 0, messages_ = 0;
  std::vector<Channel> channels_;
  std::vector<ChunkIndex> chunks_;
  std::vector<MetadataIndex> metadata_;
};

}  // namespace solenoid
