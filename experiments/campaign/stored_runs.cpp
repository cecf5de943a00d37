#include "experiments/campaign/stored_runs.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/bytes.hpp"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>

namespace solenoid {
namespace {

namespace fs = std::filesystem;

constexpr const char* runs_ending = ".runs";
constexpr const char* traces_ending = ".traces";

FileState state_of(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return {};
  return {static_cast<std::uint64_t>(status.st_ino), static_cast<std::uint64_t>(status.st_size)};
}

StoredRuns::Ending ending_of(std::string_view status) {
  using Ending = StoredRuns::Ending;
  return status == "ok" ? Ending::ok : status.starts_with("failed") ? Ending::failed : Ending::unstable;
}

/// "3 runs", "1 run".
std::string runs_text(std::uint64_t count) { return fmt::format("{} run{}", count, count == 1 ? "" : "s"); }

}  // namespace

StoredRuns::StoredRuns(std::string folder, const Campaign& campaign, const std::string& maker)
    : folder_(std::move(folder)),
      maker_(maker.empty() ? campaign.maker : maker),
      runs_(campaign.runs),
      places_(campaign.runs.size()) {}

bool StoredRuns::refresh(const std::function<bool(const std::string& name)>& only) {
  if (std::ranges::any_of(files_, [](const File& file) { return is_another(file); })) begin_again();
  list_files(only);
  bool news = false;
  for (std::uint32_t i = 0; i < files_.size(); ++i) news = read_file(i) || news;
  return news;
}

void StoredRuns::add_file(const std::string& path) {
  if (known_.try_emplace(path, files_.size()).second) files_.push_back({.path = path});
  read_file(known_.at(path));
}

void StoredRuns::leave_aside() {
  refresh();
  std::ranges::fill(places_, Place{});
}

void StoredRuns::list_files(const std::function<bool(const std::string& name)>& only) {
  std::error_code error;
  std::vector<std::string> paths;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_ + "/shards", error))
    if (entry.path().extension() == runs_ending && (!only || only(entry.path().stem().string())))
      paths.push_back((entry.path().parent_path() / entry.path().stem()).string());
  std::ranges::sort(paths);
  for (const std::string& path : paths)
    if (known_.try_emplace(path, files_.size()).second) files_.push_back({.path = path});
}

bool StoredRuns::read_file(std::uint32_t index) {
  File& file = files_[index];
  const std::string path = file.path + runs_ending;
  const FileState state = state_of(path);
  if (state == file.state) return false;
  FrameReader frames(path, file.end);
  bool news = false;
  while (frames.next()) {
    try {
      if (const auto session = session_frame(frames.content())) take_session(*session);
      if (const auto run = run_frame(frames.content())) news = take_run(index, frames.offset(), *run) || news;
    } catch (const std::invalid_argument&) {
      file.damaged += frames.content().size();
    }
  }
  file.damaged += frames.damaged();
  file.rest = frames.rest();
  file.end = frames.end();
  file.state = state;
  return news;
}

/// Whether a file that was read is gone, shorter, or another in its place.
bool StoredRuns::is_another(const File& file) {
  if (file.state == FileState{}) return false;
  const FileState now = state_of(file.path + runs_ending);
  return now.number != file.state.number || now.bytes < file.end;
}

/// What it had may be in other files too: all are read from their beginnings.
void StoredRuns::begin_again() {
  std::ranges::fill(places_, Place{});
  files_.clear();
  known_.clear();
}

void StoredRuns::take_session(std::string_view text) {
  if (session_numbers_.contains(crc32(text))) return;
  sessions_.push_back(decode_session(text));
  session_numbers_.emplace(crc32(text), sessions_.size() - 1);
}

bool StoredRuns::take_run(std::uint32_t index, std::uint64_t offset, const RunFrame& frame) {
  File& file = files_[index];
  const auto session = session_numbers_.find(frame.session);
  if (session == session_numbers_.end()) throw std::invalid_argument("is of no known session");
  if (sessions_[session->second].maker != maker_) return ++file.others_programs, false;
  const RunHead head = decode_head(frame.run);
  const auto run = runs_.find(std::string(head.scenario), std::string(head.variant), head.seed);
  if (!run || hash_number(runs_[*run].hash) != head.configuration) return ++file.others_campaigns, false;
  const Place place{offset,
                    frame.trace,
                    frame.trace_checksum,
                    index,
                    session->second,
                    static_cast<float>(head.wall_s),
                    static_cast<std::uint8_t>(ending_of(head.status))};
  Place& before = places_[*run];
  if (!counts_more(place, before)) return ++copies_, false;
  before = place;
  return true;
}

bool StoredRuns::counts_more(const Place& place, const Place& before) const {
  const auto failed = static_cast<std::uint8_t>(Ending::failed);
  if (before.ending <= failed || place.ending <= failed) {
    if (before.ending != place.ending) return place.ending > before.ending;
  }
  const auto began = [&](const Place& p) { return sessions_[p.session].began_ms; };
  if (began(place) != began(before)) return began(place) > began(before);
  return before.trace == no_trace && place.trace != no_trace;
}

std::size_t StoredRuns::count(Ending ending) const {
  return static_cast<std::size_t>(std::ranges::count(places_, static_cast<std::uint8_t>(ending), &Place::ending));
}

KeptRun StoredRuns::decode(std::size_t run, std::string_view content) const {
  const Place& place = places_[run];
  try {
    KeptRun kept = decode_run(run_frame(content).value().run, sessions_[place.session]);
    if (kept.configuration != runs_[run].hash) throw std::invalid_argument("is another run's by now");
    return kept;
  } catch (const std::exception& error) {
    throw ConfigError(fmt::format("{}{}: record at byte {} {} (allowed: a file as `solenoid compare` wrote it)",
                                  files_[place.file].path, runs_ending, place.offset, error.what()));
  }
}

KeptRun StoredRuns::read(std::size_t run) const {
  const Place& place = places_[run];
  return decode(run, read_frame(files_[place.file].path + runs_ending, place.offset));
}

StoredRuns::Reader::Reader(const StoredRuns& runs) : runs_(runs) {
  // A window holds some dozens of records, and all of them together little beside what a report needs.
  constexpr std::size_t all_windows = 64 << 20, least = 1 << 11, most = 1 << 18;
  const std::size_t bytes = std::clamp(all_windows / std::max<std::size_t>(1, runs.files_.size()), least, most);
  files_.reserve(runs.files_.size());
  for (const File& file : runs.files_) files_.emplace_back(file.path + runs_ending, bytes);
}

KeptRun StoredRuns::Reader::read(std::size_t run) {
  const Place& place = runs_.places_[run];
  return runs_.decode(run, files_[place.file].content(place.offset));
}

std::optional<std::string> StoredRuns::trace(std::size_t run) const {
  const Place& place = places_[run];
  if (place.trace == no_trace) return std::nullopt;
  std::string bytes = read_frame(trace_file(run), place.trace);
  if (crc32(bytes) != place.trace_checksum)
    throw ConfigError(
        fmt::format("{}: the trace at byte {} is not that of its run (allowed: the file that was written "
                    "with {}{})",
                    trace_file(run), place.trace, files_[place.file].path, runs_ending));
  return bytes;
}

std::string StoredRuns::trace_file(std::size_t run) const { return files_[places_[run].file].path + traces_ending; }

std::vector<std::string> StoredRuns::damage() const {
  std::vector<std::string> lines;
  for (const File& file : files_) {
    const auto tell = [&](std::uint64_t bytes, const char* what) {
      if (bytes > 0) lines.push_back(fmt::format("{}{}: {} bytes {}", file.path, runs_ending, bytes, what));
    };
    tell(file.damaged, "are damaged: not counted");
    tell(file.rest, "at its end are of no whole record: not counted");
  }
  return lines;
}

std::vector<std::string> StoredRuns::strangers() const {
  std::vector<std::string> lines;
  for (const File& file : files_) {
    const auto tell = [&](std::uint64_t runs, const std::string& whose) {
      if (runs > 0)
        lines.push_back(fmt::format("{}{}: {} of {}: not counted", file.path, runs_ending, runs_text(runs), whose));
    };
    tell(file.others_programs, "another program or other plug-ins");
    tell(file.others_campaigns, "another campaign, or of this one before it was changed");
  }
  return lines;
}

std::vector<std::string> StoredRuns::problems() const {
  std::vector<std::string> lines = damage();
  std::ranges::move(strangers(), std::back_inserter(lines));
  return lines;
}

std::vector<std::string> StoredRuns::hosts() const {
  std::vector<std::string> names;
  for (const WritingSession& session : sessions_)
    if (session.maker == maker_) names.push_back(session.host);
  std::ranges::sort(names);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

std::uint64_t StoredRuns::bytes() const {
  std::uint64_t sum = 0;
  for (const File& file : files_) sum += file.state.bytes + state_of(file.path + traces_ending).bytes;
  return sum;
}

std::vector<UnreadRun> for_each_run(const StoredRuns& runs,
                                    const std::function<void(std::size_t run, const KeptRun& kept)>& take) {
  std::vector<UnreadRun> unread;
  StoredRuns::Reader reader(runs);
  for (std::size_t run = 0; run < runs.size(); ++run) {
    if (!runs.has(run)) continue;
    std::optional<KeptRun> kept;
    try {
      kept = reader.read(run);
    } catch (const ConfigError& error) {
      unread.push_back({run, error.what()});
      continue;
    }
    take(run, *kept);
  }
  return unread;
}

}  // namespace solenoid
