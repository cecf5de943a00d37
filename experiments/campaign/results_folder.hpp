#pragma once

#include "experiments/base/files.hpp"
#include "experiments/campaign/shard_scratch.hpp"
#include "experiments/campaign/shards.hpp"
#include "experiments/campaign/stored_runs.hpp"

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace spdlog {
class logger;
}

namespace solenoid {

/// Writes the files that a campaign carries, below a folder. Throws OutputError.
void write_inputs(const std::vector<InputFile>& inputs, const std::string& folder);
/// Writes a campaign into its folder: resolved.toml and its inputs. Throws OutputError.
void write_campaign(const Campaign& campaign, const std::string& folder);

/// Has a folder hold what all shards of a campaign have in common: whoever comes first writes it. Throws ConfigError if it
/// is another campaign's or another program's, OutputError.
void prepare_for_shards(const Campaign& campaign, const std::string& folder, int shards);

/// Keeps a results folder for this process alone, or for those that share it, where the file system knows of locks.
class FolderLock {
 public:
  /// Throws OutputError if it is in use, or cannot be written.
  FolderLock(const std::string& folder, FileLock lock);

 private:
  OpenFile file_;
};

/// The folder of a campaign's results while a process writes into it:
///
///   resolved.toml, inputs/   the campaign, to run again
///   manifest.json            program, machine, seeds, times, counts; status running | finished | interrupted | failed
///   shards/NAME.runs         runs as they end, NAME.traces the same over time (shard_file.hpp); NAME: all, or 03-of-40
///   runs.csv                 all of them in canonical order; absent while the campaign runs
///   log.txt                  what happened when, of a campaign that is not parted
///
/// A campaign that is not parted has the folder to itself. Of one that is, each process has its shard; whoever comes first
/// writes what all have in common, and the others see that it is the same. manifest.json, resolved.toml and runs.csv appear
/// whole or not at all. All members throw OutputError naming the file.
class ResultsFolder {
 public:
  struct Settings {
    int jobs = 1;
    Shard shard{};
    std::string scratch = {};  ///< a folder near the processor that the shard's files grow in until the end; none: here
    bool logged = false;       ///< runs have a log, ID.mcap, in place of a trace
  };

  ResultsFolder(const std::string& path, const Campaign& campaign, const Settings& settings);
  ~ResultsFolder();

  const std::string& path() const { return path_; }
  /// Whether a run ended before under the same configuration and program, failed ones excepted, and those whose files are
  /// not as they were written.
  bool finished_before(std::size_t run);
  /// What was wrong with the latter, a line each.
  std::vector<std::string> distrusted() const;
  /// `encoded`: encode_run().
  void add(std::string_view encoded, std::string_view trace = {});
  void log(std::string_view line);
  /// Those that there were at the beginning; after close(), all.
  const StoredRuns& runs() const { return runs_; }
  /// Has the shard's files where they belong, and if the campaign is not parted writes runs.csv and the last manifest.
  void close(std::string_view status);
  /// After an OutputError: marks the manifest as far as the disk lets it. Never throws.
  void abandon(std::string_view reason) noexcept;

 private:
  std::string file(const std::string& name) const { return path_ + "/" + name; }
  std::string shard_file() const { return "shards/" + settings_.shard.name(); }
  void begin_alone();
  void begin_shard();
  /// Some room on the disk, where it can be had, which is given back when it is full: so that what happened can be told.
  void keep_room();
  void give_room_back() noexcept;
  void write(const std::string& name, std::string_view bytes);
  void open_log();
  ShardWriter& writer();
  void sync_now_and_then();
  void leave_scratch();
  void put_back();

  std::string path_;
  const Campaign& campaign_;
  Settings settings_;
  std::optional<FolderLock> lock_;
  std::string started_;
  std::shared_ptr<spdlog::logger> log_;
  StoredRuns runs_;
  std::unique_ptr<ShardWriter> writer_;
  std::optional<ShardScratch> scratch_;
  std::chrono::steady_clock::time_point synced_ = std::chrono::steady_clock::now();
  std::vector<std::string> distrusted_;
};

/// Writes runs.csv: the campaign's runs that are there in canonical order, one after the other. Runs whose record cannot
/// be read any more are left out. Throws OutputError.
void write_runs_csv(const std::string& folder, const Campaign& campaign, const StoredRuns& runs);

}  // namespace solenoid
