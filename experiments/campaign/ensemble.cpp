#include "experiments/campaign/ensemble.hpp"

#include "core/config/reader.hpp"
#include "experiments/campaign/sampling.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

double at(const Ensemble::Interval& range, double share, bool logarithmic) {
  return logarithmic ? range.low * std::pow(range.high / range.low, share)
                     : range.low + (range.high - range.low) * share;
}

/// Sets "mismatch.friction" and the like.
void insert_at(toml::table& table, const std::string& path, double value) {
  const std::size_t dot = path.find('.');
  if (dot == std::string::npos) {
    table.insert_or_assign(path, value);
    return;
  }
  const std::string head = path.substr(0, dot);
  if (!table.contains(head)) table.insert(head, toml::table{});
  table[head].as_table()->insert_or_assign(path.substr(dot + 1), value);
}

}  // namespace

Ensemble read_ensemble(TableReader& table, std::span<const DrawnQuantity> quantities) {
  Ensemble e;
  e.members = table.integer("members", 1, 999);
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

std::vector<toml::table> ensemble_scenarios(const Ensemble& e, std::span<const DrawnQuantity> quantities,
                                            const toml::table& scenario) {
  std::vector<toml::table> members;
  const Sampler sampler(Sampling::shuffled, e.seed, quantities.size(), static_cast<std::size_t>(e.members));
  for (int m = 0; m < e.members; ++m) {
    const std::vector<double> shares = sampler.at(static_cast<std::size_t>(m));
    toml::table member = scenario;
    member.erase("ensemble");
    member.insert_or_assign("name", fmt::format("{}-m{:03}", scenario["name"].value_or(std::string()), m + 1));
    for (const std::string& key : drawn_keys(quantities, false)) member.erase(key);
    for (std::size_t i = 0; i < quantities.size(); ++i) {
      const DrawnQuantity& q = quantities[i];
      const Ensemble::Interval& range = e.intervals[i];
      if (q.optional && range.low == q.usual && range.high == q.usual) continue;
      insert_at(member, q.path, at(range, shares[i], q.logarithmic));
    }
    members.push_back(std::move(member));
  }
  return members;
}

std::vector<std::string> drawn_keys(std::span<const DrawnQuantity> quantities, bool with_optional) {
  std::vector<std::string> keys;
  for (const DrawnQuantity& q : quantities) {
    const std::string key = q.path.substr(0, q.path.find('.'));
    if ((with_optional || !q.optional) && std::ranges::count(keys, key) == 0) keys.push_back(key);
  }
  return keys;
}

std::string ensemble_name(const std::string& scenario) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const std::size_t n = scenario.size();
  const bool numbered =
      n > 5 && scenario.compare(n - 5, 2, "-m") == 0 && std::all_of(scenario.end() - 3, scenario.end(), is_digit);
  return numbered ? scenario.substr(0, n - 5) : scenario;
}

}  // namespace solenoid
