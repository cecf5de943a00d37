#include "experiments/campaign/results_folder.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/build_info.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/campaign/run_file.hpp"
#include "experiments/plugin/load_plugin.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <unistd.h>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

/// JSON of any text, bytes that are not UTF-8 replaced.
std::string dump(const Json& json) { return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

Json counts(const Campaign& campaign, std::span<const RunRecord> records) {
  const auto count = [&](auto which) { return std::count_if(records.begin(), records.end(), which); };
  const auto ok = count([](const RunRecord& r) { return r.ok(); });
  const auto failed = count([](const RunRecord& r) { return r.failed(); });
  const auto ended = static_cast<std::ptrdiff_t>(records.size());
  return {{"runs", campaign.runs.size()},
          {"ok", ok},
          {"unstable", ended - ok - failed},
          {"failed", failed},
          {"missing", static_cast<std::ptrdiff_t>(campaign.runs.size()) - ended}};
}

template <class T>
Json names(const std::vector<T>& configs) {
  Json list = Json::array();
  for (const T& config : configs) list.push_back(config.name);
  return list;
}

}  // namespace

void write_inputs(const std::vector<InputFile>& inputs, const std::string& folder) {
  for (const InputFile& input : inputs) {
    const std::filesystem::path path = std::filesystem::path(folder) / input.name;
    create_folder(path.parent_path().string());
    write_file_atomically(path.string(), input.text);
  }
}

ResultsFolder::ResultsFolder(const std::string& path, const Campaign& campaign, int jobs)
    : path_(path), campaign_(campaign), jobs_(jobs), started_(timestamp()) {
  create_folder(file("runs"));
  for (const char* name : {".lock", ".room", "log.txt"}) require_no_device(file(name));
  lock();
  keep_room();
  write_manifest("running", {});
  ::unlink(file("runs.csv").c_str());
  write_inputs(campaign.inputs, path_);
  write_file_atomically(file("resolved.toml"), campaign.resolved_toml);
  open_log();
  log(fmt::format("campaign {}: {} runs, {} jobs", campaign.name, campaign.runs.size(), jobs));
}

ResultsFolder::~ResultsFolder() {
  give_room_back();
  if (lock_ >= 0) ::close(lock_);
}

void ResultsFolder::lock() {
  lock_ = ::open(file(".lock").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (lock_ < 0) throw OutputError(fmt::format("{}: cannot be written: {}", file(".lock"), std::strerror(errno)));
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    ::close(lock_);
    lock_ = -1;
    throw OutputError(fmt::format("{}: in use by another solenoid", path_));
  }
}

void ResultsFolder::keep_room() {
  constexpr off_t last_words = 256 * 1024;  // some results, runs.csv, a manifest
  const int room = ::open(file(".room").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (room < 0) return;
  const bool kept = ::posix_fallocate(room, 0, last_words) == 0;
  ::close(room);
  if (!kept) give_room_back();
}

void ResultsFolder::give_room_back() noexcept { ::unlink(file(".room").c_str()); }

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

void ResultsFolder::log(std::string_view line) { log_->info("{}", line); }

std::optional<RunRecord> ResultsFolder::finished_before(const CampaignRun& run) {
  try {
    const auto kept = read_run_file(file("runs/" + run.id + ".json"));
    if (!kept || kept->configuration != run.hash || kept->record.failed()) return std::nullopt;
    require_checksums(*kept, file("runs/" + run.id + ".json"));
    require_trace(*kept, file("runs/" + run.id + ".trace"));
    return kept->record;
  } catch (const ConfigError& error) {
    log(error.what());
    distrusted_.push_back(error.what());
    return std::nullopt;
  }
}

void ResultsFolder::add(const CampaignRun& run, const RunRecord& record, std::string_view trace) {
  if (trace.empty())
    ::unlink(file("runs/" + run.id + ".trace").c_str());  // of an earlier run
  else
    write("runs/" + run.id + ".trace", trace);
  write("runs/" + run.id + ".json", run_file_text(run.hash, record, trace));
  log(fmt::format("{}: {}", run.id, first_line(record.status)));
}

void ResultsFolder::write_manifest(std::string_view status, std::span<const RunRecord> records,
                                   std::string_view reason) {
  const BuildInfo build = build_info();
  const Machine machine = this_machine();
  Json json = {{"campaign", campaign_.name}, {"status", status}};
  if (!reason.empty()) json["reason"] = reason;
  json["program"] = {{"version", build.version},
                     {"git_revision", build.git_revision.empty() ? "unknown" : build.git_revision},
                     {"compiler", build.compiler},
                     {"build_type", build.build_type},
                     {"fingerprint", program_fingerprint()}};
  if (!loaded_plugins().empty()) json["plugins"] = Json::array();
  for (const LoadedPlugin& plugin : loaded_plugins())
    json["plugins"].push_back({{"name", plugin.name}, {"file", plugin.path}, {"fingerprint", plugin.fingerprint}});
  json["machine"] = {
      {"host", machine.host}, {"cpu", machine.cpu}, {"cores", machine.cores}, {"kernel", machine.kernel}};
  json["jobs"] = jobs_;
  json["variants"] = names(campaign_.variants);
  json["scenarios"] = campaign_.scenarios.tasks();
  json["seeds"] = campaign_.seeds;
  json["started"] = started_;
  if (status != "running") json["ended"] = timestamp();
  json["counts"] = counts(campaign_, records);
  write("manifest.json", dump(json));
}

void ResultsFolder::close(std::string_view status, std::span<const RunRecord> records) {
  give_room_back();
  log(status);
  write("runs.csv", to_csv(records));
  write_manifest(status, records);
}

void ResultsFolder::abandon(std::string_view reason) noexcept {
  try {
    write_manifest("failed", {}, reason);
  } catch (const std::exception&) {
    // Somebody else took the room that was kept: the manifest goes on saying "running", and runs.csv stays absent.
  }
}

}  // namespace solenoid
