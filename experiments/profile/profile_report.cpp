#include "experiments/profile/profile_report.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/machine.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* format_name = "solenoid-profile-1";

Json json_of(const RatioInterval& r) { return {{"ratio", r.ratio}, {"low", r.low}, {"high", r.high}}; }

Json json_of(const VariantProfile& p) {
  Json j = {{"name", p.name},
            {"instances", p.solve_us.size()},
            {"p50_us", p.time_us.p50},
            {"p90_us", p.time_us.p90},
            {"p99_us", p.time_us.p99},
            {"p999_us", p.time_us.p999},
            {"max_us", p.time_us.max},
            {"misses", p.misses},
            {"limit_misses", p.limit_misses},
            {"passes", p.passes},
            {"one_pass_p50_us", p.one_pass_us.p50},
            {"one_pass_p999_us", p.one_pass_us.p999},
            {"one_pass_max_us", p.one_pass_us.max},
            {"estimate_us", p.estimate_us},
            {"prepare_us", p.prepare_us},
            {"rollout_us", p.rollout_us},
            {"factorisation_us", p.factorisation_us},
            {"bound_us", p.bound_us},
            {"other_us", p.other_us},
            {"has_phases", p.has_phases},
            {"timed_p50_us", p.timed_us.p50},
            {"timing_overhead_percent", p.overhead_percent},
            {"nodes_p50", p.nodes.p50},
            {"nodes_p99", p.nodes.p99},
            {"nodes_max", p.nodes.max},
            {"plans_as_recorded", p.plans_as_recorded},
            {"proven_optimal_fraction", p.proven_fraction},
            {"instances_fingerprint", p.fingerprint}};
  Json bins = Json::array();
  for (std::size_t i = 0; i < p.histogram.size(); ++i)
    if (p.histogram[i] > 0) bins.push_back({{"from_us", histogram_edge_us(i)}, {"instances", p.histogram[i]}});
  j["histogram"] = std::move(bins);
  if (p.counters)
    for (std::size_t i = 0; i < CounterValues::names.size(); ++i)
      if (p.counters->value[i] >= 0) j["counters"][CounterValues::names[i]] = p.counters->value[i];
  return j;
}

Json json_of(const ProfileChange& change, double threshold) {
  Json variants = Json::array();
  for (const VariantChange& c : change.variants)
    variants.push_back(
        {{"name", c.name}, {"typical", json_of(c.typical)}, {"p99", json_of(c.tail)}, {"slower", c.slower}});
  return {{"threshold", threshold},
          {"variants", variants},
          {"only_now", change.only_now},
          {"only_then", change.only_then},
          {"slower", change.slower()}};
}

std::vector<double> times_of(const Json& j) {
  std::vector<double> times = j.at("solve_us").get<std::vector<double>>();
  for (const double t : times)
    if (!(t > 0)) throw std::invalid_argument("a time that is not above 0");
  return times;
}

}  // namespace

std::string profile_json(const ProfileResult& result, bool instances) {
  const Machine machine = this_machine();
  Json variants = Json::array();
  for (const VariantProfile& p : result.profile.variants) {
    Json j = json_of(p);
    if (instances) j["solve_us"] = p.solve_us;
    variants.push_back(std::move(j));
  }
  Json all = {{"variants", std::move(variants)},
              {"format", format_name},
              {"source", result.source},
              {"core", result.profile.core},
              {"limit_ms", result.profile.limit_ms},
              {"machine", {{"cpu", machine.cpu}, {"kernel", machine.kernel}, {"cores", machine.cores}}}};
  if (!result.profile.counters_missing.empty()) all["counters_missing"] = result.profile.counters_missing;
  if (!result.quality.empty()) {
    all["quality"] = Json::array();
    for (const QualityPoint& q : result.quality)
      all["quality"].push_back({{"variant", q.variant},
                                {"budget_ms", q.budget_ms},
                                {"rmse_mm", q.rmse_mm},
                                {"proven_optimal_fraction", q.proven_fraction},
                                {"late_fraction", q.late_fraction},
                                {"unstable", q.unstable}});
  }
  if (result.change) all["against"] = json_of(*result.change, result.threshold);
  return all.dump(1) + "\n";
}

std::string profile_csv(const ProfileResult& result) {
  std::string head, body;
  for (const VariantProfile& p : result.profile.variants) {
    Json j = json_of(p);
    j.erase("histogram");
    j.erase("counters");
    std::string names, cells;
    for (const auto& [key, value] : j.items()) {
      names += (names.empty() ? "" : ",") + key;
      cells += (cells.empty() ? "" : ",") + (value.is_string() ? value.get<std::string>() : value.dump());
    }
    head = names + "\n";
    body += cells + "\n";
  }
  return head + body;
}

Profile read_profile(const std::string& path) {
  const auto text = read_whole_file(path);
  if (!text) throw ConfigError(fmt::format("{}: cannot be read (allowed: what profile --save wrote)", path));
  try {
    const Json all = Json::parse(*text);
    if (all.at("format") != format_name) throw std::invalid_argument("another format");
    Profile profile;
    for (const Json& j : all.at("variants")) {
      VariantProfile p;
      p.name = j.at("name").get<std::string>();
      p.fingerprint = j.at("instances_fingerprint").get<std::string>();
      p.solve_us = times_of(j);
      profile.variants.push_back(std::move(p));
    }
    return profile;
  } catch (const std::exception& error) {
    throw ConfigError(fmt::format("{}: no profile: {} (allowed: what profile --save wrote)", path, error.what()));
  }
}

}  // namespace solenoid
