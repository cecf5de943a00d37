#include "experiments/campaign/results_folder.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/campaign/manifest.hpp"
#include "experiments/campaign/written_runs.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

namespace solenoid {

namespace fs = std::filesystem;

namespace {

void tell_of_older_runs(const std::string& folder) {
  if (fs::is_directory(folder + "/runs"))
    std::fprintf(stderr, "solenoid: %s/runs: what the version before wrote is done again, and shown no more\n",
                 folder.c_str());
}

/// An end of a shard's file that is no whole record, unless somebody is writing it.
void take_off_torn_end(const std::string& path) {
  if (!fs::exists(path)) return;
  try {
    const FrameWriter whole(path);
  } catch (const FileInUse&) {
    // its own business
  }
}

}  // namespace

void write_inputs(const std::vector<InputFile>& inputs, const std::string& folder) {
  for (const InputFile& input : inputs) {
    const fs::path path = fs::path(folder) / input.name;
    create_folder(path.parent_path().string());
    write_file_atomically(path.string(), input.text, Writers::several);
  }
}

void write_campaign(const Campaign& campaign, const std::string& folder) {
  write_inputs(campaign.inputs, folder);
  write_file_atomically(folder + "/resolved.toml", campaign.resolved_toml, Writers::several);
}

FolderLock::FolderLock(const std::string& folder, FileLock lock) {
  const std::string path = folder + "/.lock";
  file_ = OpenFile(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644));
  if (!file_) throw OutputError(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
  if (!take_lock(file_, lock)) throw OutputError(fmt::format("{}: in use by another solenoid", folder));
}

ResultsFolder::ResultsFolder(const std::string& path, const Campaign& campaign, const Settings& settings)
    : path_(path), campaign_(campaign), settings_(settings), started_(timestamp()), runs_(path, campaign) {
  create_folder(path_);
  for (const std::string& name :
       {std::string(".lock"), std::string(".room"), std::string("log.txt"), shard_file() + ".runs"})
    require_no_device(file(name));
  lock_.emplace(path_, settings_.shard.alone ? FileLock::alone : FileLock::shared);
  if (settings_.shard.alone)
    begin_alone();
  else
    begin_shard();
}

ResultsFolder::~ResultsFolder() { give_room_back(); }

void ResultsFolder::begin_alone() {
  keep_room();
  write("manifest.json", manifest_text(campaign_, {"running", "", started_, "", settings_.jobs, 0}, nullptr));
  ::unlink(file("runs.csv").c_str());
  tell_of_older_runs(path_);
  create_folder(file("shards"));
  write_campaign(campaign_, path_);
  open_log();
  log(fmt::format("campaign {}: {} runs, {} jobs", campaign_.name, campaign_.runs.size(), settings_.jobs));
  runs_.refresh();
}

void ResultsFolder::begin_shard() {
  prepare_for_shards(campaign_, path_, settings_.shard.count);
  const std::string own = settings_.shard.name(), alike = own.substr(own.find("-of-"));
  // A run that another shard of as many has is not ours.
  runs_.refresh([&](const std::string& name) { return name == own || !name.ends_with(alike); });
  if (settings_.scratch.empty()) return;
  scratch_.emplace(settings_.scratch, file(shard_file()));
  if (scratch_->left_before()) runs_.add_file(scratch_->path());
}

void prepare_for_shards(const Campaign& campaign, const std::string& folder, int shards) {
  const auto there = read_whole_file(folder + "/resolved.toml", file_size::configuration);
  if (there && *there != campaign.resolved_toml)
    throw ConfigError(
        fmt::format("{}/resolved.toml: is of another campaign (allowed: a new folder, or this campaign's)", folder));
  const auto maker = maker_of_folder(folder);
  if (maker && *maker != campaign.maker)
    throw ConfigError(
        fmt::format("{}/manifest.json: its runs are made by another program or other plug-ins, {}; this is "
                    "{} (allowed: a new folder, or that program)",
                    folder, *maker, campaign.maker));
  if (!fs::exists(folder + "/shards")) tell_of_older_runs(folder);
  create_folder(folder + "/shards");
  if (!there) write_campaign(campaign, folder);
  if (!maker)
    write_file_atomically(folder + "/manifest.json",
                          manifest_text(campaign, {"running", "", timestamp(), "", 0, shards}, nullptr),
                          Writers::several);
}

void ResultsFolder::keep_room() {
  constexpr off_t last_words = 256 * 1024;  // some results, runs.csv, a manifest
  const OpenFile room(::open(file(".room").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644));
  if (room && ::posix_fallocate(room.descriptor(), 0, last_words) != 0) give_room_back();
}

void ResultsFolder::give_room_back() noexcept {
  if (settings_.shard.alone) ::unlink(file(".room").c_str());
}

void ResultsFolder::write(const std::string& name, std::string_view bytes) {
  try {
    write_file_atomically(file(name), bytes);
  } catch (const OutputError&) {
    give_room_back();
    write_file_atomically(file(name), bytes);
  }
}

void ResultsFolder::open_log() {
  try {
    log_ = std::make_shared<spdlog::logger>("campaign",
                                            std::make_shared<spdlog::sinks::basic_file_sink_st>(file("log.txt")));
  } catch (const spdlog::spdlog_ex& error) {
    throw OutputError(fmt::format("{}: cannot be written: {}", file("log.txt"), error.what()));
  }
  log_->set_pattern("%Y-%m-%dT%H:%M:%S.%e %v");
  log_->flush_on(spdlog::level::info);
  log_->set_error_handler([name = file("log.txt")](const std::string& problem) {
    throw OutputError(fmt::format("{}: cannot be written: {}", name, problem));
  });
}

void ResultsFolder::log(std::string_view line) {
  if (log_) log_->info("{}", line);
}

bool ResultsFolder::finished_before(std::size_t run) {
  using Ending = StoredRuns::Ending;
  if (runs_.ending(run) != Ending::ok && runs_.ending(run) != Ending::unstable) return false;
  try {
    runs_.trace(run);
    return true;
  } catch (const ConfigError& error) {
    log(error.what());
    distrusted_.push_back(error.what());
    runs_.forget(run);
    return false;
  }
}

std::vector<std::string> ResultsFolder::distrusted() const {
  std::vector<std::string> lines = distrusted_;
  std::ranges::move(runs_.problems(), std::back_inserter(lines));
  return lines;
}

ShardWriter& ResultsFolder::writer() {
  if (writer_) return *writer_;
  WritingSession session = session_of(campaign_);
  session.logged = settings_.logged;
  writer_ = std::make_unique<ShardWriter>(scratch_ ? scratch_->path() : file(shard_file()), session);
  return *writer_;
}

void ResultsFolder::add(std::string_view encoded, std::string_view trace) {
  try {
    writer().add(encoded, trace);
  } catch (const OutputError&) {
    give_room_back();
    leave_scratch();
    writer().add(encoded, trace);
  }
  const RunHead head = decode_head(encoded);
  log(fmt::format("{}: {}", run_id(std::string(head.scenario), std::string(head.variant), head.seed),
                  first_line(std::string(head.status))));
  sync_now_and_then();
}

/// What a loss of power may take: half a minute of runs, of which each is done again.
void ResultsFolder::sync_now_and_then() {
  constexpr auto often_enough = std::chrono::seconds(30);
  const auto now = std::chrono::steady_clock::now();
  if (scratch_ || now - synced_ < often_enough) return;
  synced_ = now;
  writer().sync();
}

/// A node's disk may be full where the folder's is not.
void ResultsFolder::leave_scratch() {
  if (!scratch_) return;
  const bool written = writer_ != nullptr || scratch_->left_before();
  writer_.reset();
  scratch_->put_back(written);
  scratch_.reset();
}

void ResultsFolder::put_back() {
  const bool added = writer_ != nullptr || (scratch_ && scratch_->left_before());
  if (scratch_)
    leave_scratch();
  else if (writer_)
    writer_->sync();
  else
    take_off_torn_end(file(shard_file() + ".runs"));
  if (added) ::unlink(file("runs.csv").c_str());  // it is not of all any more
}

void ResultsFolder::close(std::string_view status) {
  give_room_back();
  log(status);
  put_back();
  if (!settings_.shard.alone) return;
  runs_.refresh();
  write_runs_csv(path_, campaign_, runs_);
  write("manifest.json",
        manifest_text(campaign_, {std::string(status), "", started_, timestamp(), settings_.jobs, 0}, &runs_));
}

void ResultsFolder::abandon(std::string_view reason) noexcept {
  try {
    put_back();
    if (!settings_.shard.alone) return;
    runs_.refresh();
    write("manifest.json",
          manifest_text(campaign_, {"failed", std::string(reason), started_, timestamp(), settings_.jobs, 0}, &runs_));
  } catch (const std::exception& error) {
    // Somebody else took the room that was kept: the manifest goes on saying "running", and runs.csv stays absent.
    if (scratch_)
      std::fprintf(stderr, "solenoid: %s\n", error.what());  // where a shard's work is, nobody finds out otherwise
  }
}

void write_runs_csv(const std::string& folder, const Campaign& campaign, const StoredRuns& runs) {
  AtomicFile csv(folder + "/runs.csv", Writers::several);
  write_csv(runs, campaign.system->description(), [&](std::string_view text) { csv.write(text); });
  csv.close();
}

}  // namespace solenoid
