#pragma once

#include "experiments/campaign/shard_file.hpp"

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// What tells a file that is another, or has changed: one that was put into its place has another number.
struct FileState {
  std::uint64_t number = 0, bytes = 0;
  bool operator==(const FileState&) const = default;
};

/// Which runs of a campaign a folder keeps, and where in its files: FOLDER/shards/*.runs and *.traces, whoever wrote them
/// (shard_file.hpp). Some tens of bytes a run stay in memory; records and traces are read when they are asked for.
///
/// A run counts once, however often it is there: that of the later session, one that failed only if there is no other.
/// What another program, other plug-ins or another configuration made does not count; it is told by strangers().
class StoredRuns {
 public:
  /// `maker`: whose runs count; empty: this program's.
  StoredRuns(std::string folder, const Campaign& campaign, const std::string& maker = {});

  /// Reads what has been written since; whether a run has come. Files that begin to match `only` are read, if it is said.
  /// Throws ConfigError if a file cannot be read.
  bool refresh(const std::function<bool(const std::string& name)>& only = {});
  /// Reads a shard that is elsewhere too, at a path without ending.
  void add_file(const std::string& path);
  /// Takes what is there as not there, until it is written again.
  void leave_aside();

  /// How a run ended, as far as it is there.
  enum class Ending : std::uint8_t { missing, failed, unstable, ok };
  Ending ending(std::size_t run) const { return static_cast<Ending>(places_[run].ending); }
  std::size_t size() const { return places_.size(); }
  bool has(std::size_t run) const { return ending(run) != Ending::missing; }
  std::size_t count(Ending ending) const;
  /// The time that it took [s].
  double wall_s(std::size_t run) const { return static_cast<double>(places_[run].wall_s); }

  /// Throws ConfigError naming the file, if that has changed since.
  KeptRun read(std::size_t run) const;
  /// Reads many runs, those of one file mostly in the order in which they were written: at a tenth of the cost.
  class Reader {
   public:
    explicit Reader(const StoredRuns& runs);
    /// As StoredRuns::read.
    KeptRun read(std::size_t run);

   private:
    const StoredRuns& runs_;
    std::vector<FrameWindow> files_;
  };
  /// A run's trace as bytes; none if it was kept without. Throws ConfigError naming file and place if it is damaged.
  std::optional<std::string> trace(std::size_t run) const;
  /// The file that it is in.
  std::string trace_file(std::size_t run) const;
  bool traced(std::size_t run) const { return places_[run].trace != no_trace; }
  /// Forgets a run whose files turned out to be damaged.
  void forget(std::size_t run) { places_[run] = {}; }

  /// Whether a run has a log in place of a trace.
  bool logged(std::size_t run) const { return has(run) && sessions_[places_[run].session].logged; }

  /// What is damaged, a line a file.
  std::vector<std::string> damage() const;
  /// What does not count, a line a file.
  std::vector<std::string> strangers() const;
  /// Both: what an operator should hear of.
  std::vector<std::string> problems() const;
  /// Records that were there already, in whatever file.
  std::size_t copies() const { return copies_; }
  /// Where they were done, each host once.
  std::vector<std::string> hosts() const;
  /// Bytes of all files, and their number.
  std::uint64_t bytes() const;
  std::size_t files() const { return files_.size(); }

 private:
  struct Place {
    std::uint64_t offset = 0, trace = no_trace;
    std::uint32_t trace_checksum = 0, file = 0, session = 0;
    float wall_s = 0.0f;
    std::uint8_t ending = 0;  ///< Ending
  };
  struct File {
    std::string path;      ///< without its ending
    FileState state = {};  ///< in which it was read
    std::uint64_t end = 0, damaged = 0, rest = 0, others_programs = 0, others_campaigns = 0;
  };

  void list_files(const std::function<bool(const std::string& name)>& only);
  bool read_file(std::uint32_t file);
  static bool is_another(const File& file);
  void begin_again();
  void take_session(std::string_view text);
  bool take_run(std::uint32_t file, std::uint64_t offset, const RunFrame& frame);
  bool counts_more(const Place& place, const Place& before) const;
  KeptRun decode(std::size_t run, std::string_view content) const;

  std::string folder_, maker_;
  RunList runs_;
  std::vector<Place> places_;  // of runs_
  std::vector<File> files_;
  std::map<std::string, std::uint32_t> known_;  // files by their paths
  std::vector<WritingSession> sessions_;
  std::map<std::uint32_t, std::uint32_t> session_numbers_;  // by checksum
  std::size_t copies_ = 0;
};

/// A run that is there and whose record cannot be read any more, and why: one line that names the file.
struct UnreadRun {
  std::size_t run = 0;
  std::string reason;
};

/// The runs that there are, in the campaign's order. What cannot be read any more is skipped, and comes back.
std::vector<UnreadRun> for_each_run(const StoredRuns& runs,
                                    const std::function<void(std::size_t run, const KeptRun& kept)>& take);

}  // namespace solenoid
