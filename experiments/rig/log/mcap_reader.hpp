#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace solenoid {

/// How much of a log is believed. Logs come from anywhere: nothing is allocated or looped over beyond these.
namespace mcap_bounds {
inline constexpr std::size_t file_bytes = 2'000'000'000;
inline constexpr std::uint64_t chunk_bytes = 128'000'000;  ///< of a chunk once decompressed
/// Of all chunks together: so many, and this many times what the file has.
inline constexpr std::uint64_t all_bytes = 256'000'000, expansion = 64;
inline constexpr std::size_t channels = 4096, schemas = 4096;
inline constexpr std::size_t metadata = 4096;  ///< records and their entries
}  // namespace mcap_bounds

struct McapChannel {
  std::string topic, encoding;
  std::string schema{};  ///< its name; empty: the channel has none
  /// "channel '/joint_states' is 'cdr' of 'sensor_msgs/msg/JointState'"
  std::string text() const;
};

struct McapMessage {
  const McapChannel& channel;
  std::uint64_t time_ns = 0;
  std::string_view data;       ///< until the call that hands it over returns
  std::uint64_t at = 0;        ///< byte of its record: in the file, or in its chunk once decompressed
  std::uint64_t chunk_at = 0;  ///< byte of its chunk in the file; 0: it is in none
  /// "byte 77 of the chunk at byte 1234"
  std::string where() const;
};

/// What a log holds beside its messages.
struct McapContents {
  std::map<std::uint16_t, McapChannel> channels;
  std::map<std::string, std::map<std::string, std::string>> metadata;
  bool complete = false;  ///< its messages are all there: they end as a closed file's do
  std::string problem;    ///< what is wrong with it, where reading had to end before that
};

/// Gets each message, and what was read before it.
using TakeMessage = std::function<void(const McapMessage&, const McapContents& so_far)>;

/// Reads an MCAP file from its front, as far as it goes: a file that was cut gives all records before the cut, those of
/// an unfinished chunk included; damage, which checksums tell, ends it likewise. Chunks are plain, zstd or lz4.
/// Each message goes to `take`, in the order of the file. Throws ConfigError, naming the file and the byte, for a file
/// that is none, that is beyond mcap_bounds, or that is built as MCAP forbids.
McapContents read_mcap(std::string_view bytes, const std::string& name, const TakeMessage& take);

}  // namespace solenoid
