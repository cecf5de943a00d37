#include "experiments/cli/value_kinds.hpp"

#include "experiments/campaign/campaign.hpp"
#include "experiments/systems/actuator/thesis/reproduce.hpp"

#include <algorithm>
#include <optional>

namespace solenoid {
namespace {

/// The campaign of that name or file; nothing if it cannot be read, which its command will say.
std::optional<Campaign> campaign_named(const std::string& name) try {
  if (name.empty()) return std::nullopt;
  return read_campaign(name, {.loads_plugins = false});  // nothing that a file names is run for a completion
} catch (const std::exception&) {
  return std::nullopt;
}

void add_once(std::vector<std::string>& names, const std::string& name) {
  if (std::ranges::find(names, name) == names.end()) names.push_back(name);
}

/// The shipped ones, which every campaign may use, and the campaign's own.
std::vector<std::string> variant_names(const std::string& campaign) {
  std::vector<std::string> names;
  for (const VariantConfig& variant : shipped_variants()) names.push_back(variant.name);
  if (const auto own = campaign_named(campaign))
    for (const VariantConfig& variant : own->variants) add_once(names, variant.name);
  return names;
}

/// Names as --scenario takes them: the members of an ensemble have one.
std::vector<std::string> scenario_names(const std::string& campaign) {
  std::vector<std::string> names;
  const auto add = [&](const Campaign& from) {
    for (const std::string& task : from.scenarios.tasks()) add_once(names, task);
  };
  if (const auto own = campaign_named(campaign))
    add(*own);
  else
    for (const std::string& shipped : shipped_campaigns()) add(read_campaign(shipped));
  return names;
}

std::vector<std::string> table_names() {
  std::vector<std::string> names = {"all"};
  for (const ReproducibleTable& table : reproducible_tables()) names.push_back(table.name);
  return names;
}

}  // namespace

ValueChoice value_choice(const std::string& kind, const std::string& campaign) {
  const std::vector<std::string> parameter_sets = {"consistent", "printed", "inferred"};
  if (kind == value_kind::variant) return {variant_names(campaign)};
  if (kind == value_kind::scenario) return {scenario_names(campaign)};
  if (kind == value_kind::campaign) return {shipped_campaigns(), {".toml"}};
  if (kind == value_kind::campaign_or_log) return {shipped_campaigns(), {".toml", ".mcap"}};
  if (kind == value_kind::parameter_set) return {parameter_sets};
  if (kind == value_kind::model) return {parameter_sets, {".toml"}};
  if (kind == value_kind::table) return {table_names()};
  if (kind == value_kind::folder) return {.folders = true};
  const std::string file = value_kind::file;
  if (kind == file || kind.starts_with(file + ".")) return {.endings = {kind.substr(file.size())}};
  return {};
}

}  // namespace solenoid
