#include "experiments/campaign/run_file.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/bytes.hpp"
#include "experiments/base/files.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* as_written = "a file as `solenoid compare` or `solenoid run` wrote it";

std::string checksum(std::string_view bytes) { return fmt::format("{:08x}", crc32(bytes)); }

std::string compact(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

std::string run_checksum(const Json& file) {
  return checksum(compact(file.at("configuration")) + compact(file.at("run")));
}

[[noreturn]] void refuse_damage(const std::string& path, const std::string& problem) {
  throw ConfigError(fmt::format("{}: {} (allowed: {})", path, problem, as_written));
}

/// What the file has at "checksums.run".
const Json& value_at(const Json& file, const std::string& key, const std::string& path) {
  std::string pointer = "/" + key;
  std::ranges::replace(pointer, '.', '/');
  const Json::json_pointer at(pointer);
  if (!file.contains(at)) refuse_damage(path, fmt::format("key '{}' is missing", key));
  return file.at(at);
}

std::string text_at(const Json& file, const std::string& key, const std::string& path) {
  const Json& value = value_at(file, key, path);
  if (!value.is_string()) refuse_damage(path, fmt::format("key '{}' is no text", key));
  return value.get<std::string>();
}

}  // namespace

std::optional<RunFile> read_run_file(const std::string& path) {
  const auto text = read_whole_file(path, file_size::record);
  if (!text) return std::nullopt;
  const auto json = parse_json(*text, path, as_written);
  RunFile file{text_at(json, "configuration", path), record_from_json(value_at(json, "run", path), path), false, {}};
  if (!json.contains("checksums")) return file;
  file.checked = true;
  if (text_at(json, "checksums.run", path) != run_checksum(json))
    refuse_damage(path, "is damaged: its checksum is another");
  if (json.at("checksums").contains("trace")) file.trace = text_at(json, "checksums.trace", path);
  return file;
}

void require_trace(const RunFile& run, const std::string& path) {
  std::error_code ignored;
  if (!run.trace && run.checked && std::filesystem::exists(path, ignored)) refuse_damage(path, "has no checksum");
  if (!run.trace) return;
  const auto bytes = read_whole_file(path, file_size::trace);
  if (!bytes) refuse_damage(path, "is missing");
  if (checksum(*bytes) != *run.trace) refuse_damage(path, "is damaged: its checksum is another");
}

}  // namespace solenoid
