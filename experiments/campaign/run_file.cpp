#include "experiments/campaign/run_file.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/bytes.hpp"
#include "experiments/base/files.hpp"

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr const char* as_written = "a file as `solenoid compare` or `solenoid run` wrote it";

std::string checksum(std::string_view bytes) { return fmt::format("{:08x}", crc32(bytes)); }

std::string compact(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string run_checksum(const nlohmann::ordered_json& file) {
  return checksum(compact(file.at("configuration")) + compact(file.at("run")));
}

[[noreturn]] void refuse_damage(const std::string& path, const std::string& problem) {
  throw ConfigError(fmt::format("{}: {} (allowed: {})", path, problem, as_written));
}

}  // namespace

std::string run_file_text(const std::string& configuration, const RunRecord& record, std::string_view trace) {
  nlohmann::ordered_json json = {{"configuration", configuration}, {"run", to_json(record)}};
  json = nlohmann::ordered_json::parse(compact(json));  // as it will be read
  json["checksums"]["run"] = run_checksum(json);
  if (!trace.empty()) json["checksums"]["trace"] = checksum(trace);
  return json.dump(2) + "\n";
}

std::optional<RunFile> read_run_file(const std::string& path) {
  const auto text = read_whole_file(path, file_size::record);
  if (!text) return std::nullopt;
  const auto json = parse_json(*text, path, as_written);
  try {
    RunFile file{json.at("configuration").get<std::string>(), record_from_json(json.at("run"), path), false, {}};
    const auto checksums = json.find("checksums");
    if (checksums == json.end()) return file;
    file.checked = true;
    if (checksums->at("run") != run_checksum(json)) refuse_damage(path, "is damaged: its checksum is another");
    if (checksums->contains("trace")) file.trace = checksums->at("trace").get<std::string>();
    return file;
  } catch (const nlohmann::ordered_json::exception& error) {
    refuse_damage(path, problem_with_json(error));
  }
}

void require_checksum(const RunFile& run, const std::string& path) {
  if (!run.checked) refuse_damage(path, "has no checksum");
}

void require_trace(const RunFile& run, const std::string& path) {
  if (!run.trace) return;
  const auto bytes = read_whole_file(path, file_size::trace);
  if (!bytes) refuse_damage(path, "is missing");
  if (checksum(*bytes) != *run.trace) refuse_damage(path, "is damaged: its checksum is another");
}

}  // namespace solenoid
