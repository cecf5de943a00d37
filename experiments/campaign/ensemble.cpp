#include "experiments/campaign/ensemble.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// "mismatch.friction": the table's key "mismatch" and in that table "friction".
struct DrawnPath {
  std::string table, key;  ///< no table: the key is the scenario's own

  explicit DrawnPath(const std::string& path) {
    const std::size_t dot = path.find('.');
    if (dot != std::string::npos) table = path.substr(0, dot);
    key = dot == std::string::npos ? path : path.substr(dot + 1);
  }
};

void insert_at(toml::table& scenario, const std::string& path, double value) {
  const DrawnPath at(path);
  if (at.table.empty()) {
    scenario.insert_or_assign(at.key, value);
    return;
  }
  if (!scenario.contains(at.table)) scenario.insert(at.table, toml::table{});
  scenario[at.table].as_table()->insert_or_assign(at.key, value);
}

/// Takes a drawn number out of the table; nothing if it is not there as one.
std::optional<double> take_from(toml::table& scenario, const std::string& path) {
  const DrawnPath at(path);
  toml::table* table = at.table.empty() ? &scenario : scenario[at.table].as_table();
  if (!table || !(*table)[at.key].is_floating_point()) return std::nullopt;
  const std::optional<double> value = (*table)[at.key].value<double>();
  table->erase(at.key);
  return value;
}

void add_drawn(std::string& text, const std::string& path, double value) {
  fmt::format_to(std::back_inserter(text), "{}={}\n", path, value);
}

int read_members(TableReader& table, Sampling sampling) {
  const int members = table.integer("members", 1, static_cast<int>(Sampler::most_points));
  if (sampling == Sampling::shuffled && members > static_cast<int>(Sampler::most_shuffled))
    table.fail("members", fmt::format("{} of them cannot be shuffled (allowed: 1 to {}, or up to {} with sampling = "
                                      "\"sobol\" or \"latin_hypercube\")",
                                      members, Sampler::most_shuffled, Sampler::most_points));
  return members;
}

Sampling read_sampling(TableReader& table) {
  const std::vector<std::string>& names = sampling_names();
  const std::string name = table.text_or("sampling", names.front(), names);
  return static_cast<Sampling>(std::ranges::find(names, name) - names.begin());
}

}  // namespace

Ensemble read_ensemble(TableReader& table, std::span<const DrawnQuantity> quantities) {
  Ensemble e;
  e.sampling = read_sampling(table);
  e.members = read_members(table, e.sampling);
  e.seed = static_cast<std::uint64_t>(table.integer_or("seed", 1, 0, 2147483647));
  for (const DrawnQuantity& q : quantities) {
    e.intervals.push_back({q.usual, q.usual});
    if (!table.has(q.name)) continue;
    const std::vector<double> ends = table.numbers(q.name, q.range);
    if (ends.size() != 2 || ends[0] > ends[1]) table.fail(q.name, "not an interval (allowed: [least, most])");
    e.intervals.back() = {ends[0], ends[1]};
  }
  table.finish();
  return e;
}

EnsembleMembers::EnsembleMembers(const Ensemble& ensemble, std::span<const DrawnQuantity> quantities,
                                 const Document& scenario, const std::string& where)
    : quantities_(quantities.begin(), quantities.end()),
      intervals_(ensemble.intervals),
      sampler_(ensemble.sampling, ensemble.seed, quantities.size(), static_cast<std::size_t>(ensemble.members)),
      scenario_(scenario.root()["name"].value_or(std::string())),
      table_(scenario) {
  table_.root().erase("ensemble");
  for (const std::string& key : drawn_keys(quantities, true))
    if (!scenario.root().contains(key)) table_.set_by(table_.path() + "." + key, where);
  for (const std::string& key : drawn_keys(quantities, false)) table_.root().erase(key);
}

std::string EnsembleMembers::name(std::size_t member) const { return member_name(scenario_, member + 1); }

bool EnsembleMembers::drawn(std::size_t quantity) const {
  const auto [low, high] = intervals_[quantity];
  const DrawnQuantity& q = quantities_[quantity];
  return !q.optional || low != q.usual || high != q.usual;
}

double EnsembleMembers::value(std::size_t quantity, double share) const {
  const auto [low, high] = intervals_[quantity];
  return quantities_[quantity].logarithmic ? low * std::pow(high / low, share) : low + (high - low) * share;
}

Document EnsembleMembers::document(const std::string& name, const std::vector<double>& shares) const {
  Document document = table_;
  document.root().insert_or_assign("name", name);
  for (std::size_t i = 0; i < quantities_.size(); ++i)
    if (drawn(i)) insert_at(document.root(), quantities_[i].path, value(i, shares[i]));
  return document;
}

Document EnsembleMembers::corner(bool high) const {
  return document(name(0), std::vector<double>(quantities_.size(), high ? 1.0 : 0.0));
}

ScenarioConfig EnsembleMembers::read(std::size_t member) const {
  TableReader reader(document(member));
  return read_scenario(reader);
}

std::string EnsembleMembers::drawn_text(std::size_t member) const {
  const std::vector<double> shares = sampler_.at(member);
  std::string text = name(member) + "\n";
  for (std::size_t i = 0; i < quantities_.size(); ++i)
    if (drawn(i)) add_drawn(text, quantities_[i].path, value(i, shares[i]));
  return text;
}

ScenarioText scenario_text(const toml::table& scenario, std::span<const DrawnQuantity> quantities) {
  toml::table rest = scenario;
  ScenarioText text{{}, scenario["name"].value_or(std::string()) + "\n"};
  rest.erase("name");
  for (const DrawnQuantity& q : quantities)
    if (const auto value = take_from(rest, q.path)) add_drawn(text.drawn, q.path, *value);
  text.rest = toml_text(rest);
  return text;
}

std::vector<std::string> drawn_keys(std::span<const DrawnQuantity> quantities, bool with_optional) {
  std::vector<std::string> keys;
  for (const DrawnQuantity& q : quantities) {
    const std::string key = q.path.substr(0, q.path.find('.'));
    if ((with_optional || !q.optional) && std::ranges::count(keys, key) == 0) keys.push_back(key);
  }
  return keys;
}

std::string member_name(const std::string& scenario, std::size_t number) {
  return fmt::format("{}-m{:03}", scenario, number);
}

std::optional<MemberName> member_named(const std::string& name) {
  constexpr std::size_t least_digits = 3, most_digits = 9;
  const std::size_t mark = name.rfind("-m");
  if (mark == std::string::npos || mark == 0) return std::nullopt;
  const std::string_view digits = std::string_view(name).substr(mark + 2);
  if (digits.size() < least_digits || digits.size() > most_digits) return std::nullopt;
  MemberName member{name.substr(0, mark), 0};
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), member.number);
  if (error != std::errc{} || end != digits.data() + digits.size() || member.number == 0) return std::nullopt;
  if (digits.size() > least_digits && digits.front() == '0') return std::nullopt;
  return member;
}

std::string ensemble_name(const std::string& scenario) {
  const auto member = member_named(scenario);
  return member ? member->scenario : scenario;
}

}  // namespace solenoid
