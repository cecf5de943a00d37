#include "experiments/campaign/ensemble.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// Uniform in [0, 1), the same with every standard library.
double unit(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

/// One point in each of n equal slices of [0, 1), in random order.
std::vector<double> stratified(int n, std::mt19937_64& random) {
  std::vector<double> points(static_cast<std::size_t>(n));
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = (static_cast<double>(i) + unit(random)) / n;
  for (std::size_t i = points.size() - 1; i > 0; --i)
    std::swap(points[i], points[static_cast<std::size_t>(unit(random) * static_cast<double>(i + 1))]);
  return points;
}

double at(const Ensemble::Interval& range, double share, bool logarithmic) {
  return logarithmic ? range.low * std::pow(range.high / range.low, share)
                     : range.low + (range.high - range.low) * share;
}

}  // namespace

Ensemble read_ensemble(TableReader& table) {
  Ensemble e;
  e.members = table.integer("members", 1, 999);
  e.seed = static_cast<std::uint64_t>(table.integer_or("seed", 1, 0, 2147483647));
  e.intervals[0] = {0.0, 0.0};
  for (std::size_t q = 0; q < e.intervals.size(); ++q) {
    const std::string key = Ensemble::names[q];
    if (!table.has(key)) continue;
    const std::vector<double> ends = table.numbers(key, q == 0 ? Range::between(0.0, 10.0) : Range{0.0, 10.0, true});
    if (ends.size() != 2 || ends[0] > ends[1]) table.fail(key, "not an interval (allowed: [least, most])");
    e.intervals[q] = {ends[0], ends[1]};
  }
  table.finish();
  return e;
}

std::vector<toml::table> ensemble_scenarios(const Ensemble& e, const toml::table& scenario) {
  std::mt19937_64 random(e.seed);
  std::array<std::vector<double>, Ensemble::names.size()> shares;
  for (auto& share : shares) share = stratified(e.members, random);
  std::vector<toml::table> members;
  for (int m = 0; m < e.members; ++m) {
    const auto value = [&](std::size_t q) { return at(e.intervals[q], shares[q][static_cast<std::size_t>(m)], q > 0); };
    toml::table member = scenario;
    member.erase("ensemble");
    member.insert_or_assign("name", fmt::format("{}-m{:03}", scenario["name"].value_or(std::string()), m + 1));
    member.insert_or_assign("payload_kg", value(0));
    toml::table mismatch;
    for (std::size_t q = 1; q + 1 < Ensemble::names.size(); ++q) mismatch.insert(Ensemble::names[q], value(q));
    member.insert_or_assign("mismatch", std::move(mismatch));
    if (e.intervals.back().low != 1.0 || e.intervals.back().high != 1.0)
      member.insert_or_assign(Ensemble::names.back(), value(Ensemble::names.size() - 1));
    members.push_back(std::move(member));
  }
  return members;
}

std::string ensemble_name(const std::string& scenario) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const std::size_t n = scenario.size();
  const bool numbered =
      n > 5 && scenario.compare(n - 5, 2, "-m") == 0 && std::all_of(scenario.end() - 3, scenario.end(), is_digit);
  return numbered ? scenario.substr(0, n - 5) : scenario;
}

}  // namespace solenoid
