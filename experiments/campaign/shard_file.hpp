#pragma once

#include "experiments/base/frames.hpp"
#include "experiments/campaign/run_record.hpp"
#include "experiments/campaign/trace.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace solenoid {

/// A run as it is kept.
struct KeptRun {
  std::string configuration;  ///< CampaignRun::hash
  RunRecord record;
  double wall_s = 0.0;  ///< it took
  SolveHistogram solves;
};

/// A run in bytes: configuration and seed [8 each], variant, scenario, trajectory, status [length 4, text], wall_s, the
/// conditions; and, if it has them, its metrics and the solver's numbers, NaN for those that it lacks; the histogram, its
/// first bin [2], their number [2], counts [8 each]. Numbers are doubles.
std::string encode_run(const KeptRun& run);

/// What wrote records into a file, and for which campaign: the frame before them. What may not be mixed is in here.
struct WritingSession {
  std::string maker;   ///< Campaign::maker: program and plug-ins
  std::string system;  ///< whose conditions and metrics these are:
  std::vector<std::string> conditions, metrics;
  std::string host;
  std::int64_t began_ms = 0;  ///< since 1970; of two records of one run the later one counts
  bool logged = false;        ///< a run has a log, FOLDER/ID.mcap, in place of a trace
};

/// What a record says first, without its numbers. The texts are those of the bytes.
struct RunHead {
  std::uint64_t configuration = 0, seed = 0;
  std::string_view variant, scenario, trajectory, status;
  double wall_s = 0.0;
};

/// Of a campaign, by this program, now.
WritingSession session_of(const Campaign& campaign);

std::string encode_session(const WritingSession& session);
/// Throws std::invalid_argument for what is no such text.
WritingSession decode_session(std::string_view text);
/// The inverse of encode_run, for records of this session. Throws std::invalid_argument for what is no such bytes.
KeptRun decode_run(std::string_view bytes, const WritingSession& session);
RunHead decode_head(std::string_view bytes);

inline constexpr std::uint64_t no_trace = ~std::uint64_t{0};

/// A frame's content that has a run.
struct RunFrame {
  std::uint32_t session = 0;         ///< its checksum
  std::uint64_t trace = no_trace;    ///< where it begins in NAME.traces
  std::uint32_t trace_checksum = 0;  ///< of its bytes
  std::string_view run;              ///< encode_run()
};
std::string encode_frame(const RunFrame& frame);
/// The inverse; none for another kind. Throws std::invalid_argument.
std::optional<RunFrame> run_frame(std::string_view content);
/// The session that a frame's content has; none for another kind.
std::optional<std::string_view> session_frame(std::string_view content);

/// A configuration as a number: CampaignRun::hash is its hexadecimal.
std::uint64_t hash_number(const std::string& hexadecimal);

/// What a frame of NAME.runs is about; the first byte of its content.
enum class FrameKind : char {
  session = 'S',  ///< JSON of a WritingSession
  run =
      'R',  ///< the session's CRC-32 [4], where in NAME.traces its trace begins or all ones [8], that one's CRC-32 [4],
            ///< encode_run()
};

/// Appends the runs of one shard's files to another's: sessions, runs and, before them, their traces; not those whose trace
/// is damaged. Returns how many runs. Paths are without ending. Throws ConfigError if the first cannot be read, FileInUse or
/// OutputError if the second cannot be written.
std::size_t append_shard(const std::string& from, const std::string& to);

/// Appends a shard's runs, and traces if there are any: two files of frames (experiments/base/frames.hpp), NAME.runs and
/// NAME.traces. They may be there already, from an earlier session; what of them is whole stays. All members throw
/// OutputError naming the file.
class ShardWriter {
 public:
  /// `path`: the files' name without ending.
  ShardWriter(std::string path, const WritingSession& session);

  /// `encoded`: encode_run(). The trace goes first, so that a record which is there has it. A run may be added again with
  /// a trace that it was added without.
  void add(std::string_view encoded, std::string_view trace = {});
  void sync();

 private:
  std::string path_;
  FrameWriter runs_;
  std::unique_ptr<FrameWriter> traces_;
  std::uint32_t session_ = 0;
};

}  // namespace solenoid
