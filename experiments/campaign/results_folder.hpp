#pragma once

#include "experiments/campaign/run_record.hpp"

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

/// The folder of a campaign's results, this process's alone while the object lives:
///
///   resolved.toml, inputs/   the campaign, to run again
///   manifest.json            program, machine, seeds, times, counts; status running | finished | interrupted | failed
///   runs/ID.json             each run as it ends (experiments/campaign/run_file.hpp)
///   runs/ID.trace            the same run over time (experiments/campaign/trace.hpp), if it is given
///   runs.csv                 all of them in canonical order; absent while the campaign runs
///   log.txt                  what happened when
///
/// Every file but the log appears whole or not at all. All members throw OutputError naming the file.
class ResultsFolder {
 public:
  ResultsFolder(const std::string& path, const Campaign& campaign, int jobs);
  ~ResultsFolder();

  const std::string& path() const { return path_; }
  /// A run that ended before under the same configuration and program, failed ones excepted, and those whose files are
  /// not as they were written.
  std::optional<RunRecord> finished_before(const CampaignRun& run);
  /// What was wrong with the latter, a line each.
  const std::vector<std::string>& distrusted() const { return distrusted_; }
  void add(const CampaignRun& run, const RunRecord& record, std::string_view trace = {});
  void log(std::string_view line);
  /// Writes runs.csv and the last manifest.
  void close(std::string_view status, std::span<const RunRecord> records);
  /// After an OutputError: marks the manifest as far as the disk lets it. Never throws.
  void abandon(std::string_view reason) noexcept;

 private:
  std::string file(const std::string& name) const { return path_ + "/" + name; }
  void lock();
  /// Some room on the disk, where it can be had, which is given back when it is full: so that what happened can be told.
  void keep_room();
  void give_room_back() noexcept;
  void write(const std::string& name, std::string_view bytes);
  void open_log();
  void write_manifest(std::string_view status, std::span<const RunRecord> records, std::string_view reason = "");

  std::string path_;
  const Campaign& campaign_;
  int jobs_, lock_ = -1;
  std::string started_;
  std::shared_ptr<spdlog::logger> log_;
  std::vector<std::string> distrusted_;
};

}  // namespace solenoid
