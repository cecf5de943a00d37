#include "experiments/campaign/manifest.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/build_info.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/plugin/load_plugin.hpp"

#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

Json counts_of(const Campaign& campaign, const StoredRuns* runs) {
  const auto count = [&](StoredRuns::Ending ending) { return runs ? runs->count(ending) : std::size_t{0}; };
  using Ending = StoredRuns::Ending;
  return {{"runs", campaign.runs.size()},
          {"ok", count(Ending::ok)},
          {"unstable", count(Ending::unstable)},
          {"failed", count(Ending::failed)},
          {"missing", runs ? count(Ending::missing) : campaign.runs.size()}};
}

/// Bytes that are not UTF-8 replaced.
std::string dumped(const Json& json) { return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

}  // namespace

std::string manifest_text(const Campaign& campaign, const ManifestFacts& facts, const StoredRuns* runs) {
  const BuildInfo build = build_info();
  const Machine machine = this_machine();
  Json json = {{"campaign", campaign.name}, {"status", facts.status}};
  if (!facts.reason.empty()) json["reason"] = facts.reason;
  json["program"] = {{"version", build.version},
                     {"git_revision", build.git_revision.empty() ? "unknown" : build.git_revision},
                     {"compiler", build.compiler},
                     {"build_type", build.build_type},
                     {"fingerprint", program_fingerprint()},
                     {"maker", campaign.maker}};
  if (!loaded_plugins().empty()) json["plugins"] = Json::array();
  for (const LoadedPlugin& plugin : loaded_plugins())
    json["plugins"].push_back({{"name", plugin.name}, {"file", plugin.path}, {"fingerprint", plugin.fingerprint}});
  json["machine"] = {
      {"host", machine.host}, {"cpu", machine.cpu}, {"cores", machine.cores}, {"kernel", machine.kernel}};
  if (runs && !runs->hosts().empty()) json["hosts"] = runs->hosts();
  if (facts.jobs > 0) json["jobs"] = facts.jobs;
  if (facts.shards > 0) json["shards"] = facts.shards;
  json["variants"] = Json::array();
  for (const VariantConfig& variant : campaign.variants) json["variants"].push_back(variant.name);
  json["scenarios"] = campaign.scenarios.tasks();
  json["seeds"] = campaign.seeds;
  json["started"] = facts.started;
  if (!facts.ended.empty()) json["ended"] = facts.ended;
  json["counts"] = counts_of(campaign, runs);
  return dumped(json);
}

std::string merged_manifest(Json manifest, const std::string& status, const Campaign& campaign,
                            const StoredRuns& runs) {
  manifest["status"] = status;
  manifest.erase("reason");
  manifest["ended"] = timestamp();
  manifest["hosts"] = runs.hosts();
  manifest["counts"] = counts_of(campaign, &runs);
  return dumped(manifest);
}

std::optional<std::string> maker_of(const Json& manifest) {
  const Json::json_pointer place("/program/maker");
  if (!manifest.contains(place) || !manifest.at(place).is_string()) return std::nullopt;
  return manifest.at(place).get<std::string>();
}

std::optional<std::string> maker_of_folder(const std::string& folder) {
  try {
    const std::string path = folder + "/manifest.json";
    const auto text = read_whole_file(path, file_size::json);
    return text ? maker_of(parse_json(*text, path)) : std::nullopt;
  } catch (const ConfigError&) {
    return std::nullopt;
  }
}

}  // namespace solenoid
