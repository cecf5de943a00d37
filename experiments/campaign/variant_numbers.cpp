#include "experiments/campaign/variant_numbers.hpp"

#include "controllers/systems.hpp"
#include "controllers/variant.hpp"
#include "core/config/reader.hpp"

#include <charconv>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::string_view blocks_prefix = "horizon.blocks.";

/// The element of an array that a key names.
std::size_t element(const toml::array& array, const std::string& key, const std::string& name) {
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), index);
  if (error != std::errc() || end != name.data() + name.size() || index >= array.size())
    throw ConfigError(fmt::format("key '{}': '{}' is no element of the variant's array of {} (allowed: 0 to {})", key,
                                  name, array.size(), array.size() - 1));
  return index;
}

void set_in(toml::table& table, const std::string& key, const std::string& rest, const auto& value) {
  const std::size_t dot = rest.find('.');
  if (dot == std::string::npos) {
    table.insert_or_assign(rest, value);
    return;
  }
  const std::string head = rest.substr(0, dot), tail = rest.substr(dot + 1);
  if (!table.contains(head)) table.insert(head, toml::table{});
  if (toml::array* array = table[head].as_array(); array && !array->empty()) {
    const std::size_t index = element(*array, key, tail);
    array->replace(array->cbegin() + static_cast<std::ptrdiff_t>(index), value);
    return;
  }
  toml::table* inner = table[head].as_table();
  if (!inner) throw ConfigError(fmt::format("key '{}': '{}' is no table of the variant", key, head));
  set_in(*inner, key, tail, value);
}

void follow_blocks(toml::table& variant) {
  std::int64_t periods = 0;
  for (const toml::node& block : *variant["horizon"]["blocks"].as_array()) periods += block.value_or(std::int64_t{0});
  TimingKeys keys;
  if (toml::table* timing = variant["timing"].as_table()) {
    keys.tick_ms = (*timing)["tick_ms"].value<double>();
    keys.period_ms = (*timing)["period_ms"].value<double>();
  }
  const System* system = find_system(variant["system"].value_or(systems().front()->name()));
  if (!system) return;  // the reader refuses it
  const Timing timing = with_keys(system->description().timing, keys, "variant");
  variant["horizon"].as_table()->insert_or_assign("steps", periods * timing.ticks_per_period);
}

}  // namespace

std::optional<double> number_at(const toml::table& variant, const std::string& key) {
  std::string path = key;
  if (path.starts_with(blocks_prefix)) path = fmt::format("horizon.blocks[{}]", path.substr(blocks_prefix.size()));
  return variant.at_path(path).value<double>();
}

void set_number(toml::table& variant, const std::string& key, double value, bool whole) {
  if (whole)
    set_in(variant, key, key, static_cast<std::int64_t>(value));
  else
    set_in(variant, key, key, value);
  if (key.starts_with(blocks_prefix) && variant["horizon"]["blocks"].is_array()) follow_blocks(variant);
}

void set_number(Document& campaign, const std::string& variant, const std::string& key, double value, bool whole,
                const std::string& who) {
  set_number(*campaign.root()["variant"][variant].as_table(), key, value, whole);
  const bool of_block = key.starts_with(blocks_prefix);  // errors name the whole list
  campaign.set_by(fmt::format("variant.{}.{}", variant, of_block ? "horizon.blocks" : key), who);
  if (of_block) campaign.set_by(fmt::format("variant.{}.horizon.steps", variant), who);
}

}  // namespace solenoid
