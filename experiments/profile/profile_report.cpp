#include "experiments/profile/profile_report.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/base/result.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

using Column = Table::Column;
using Data = Table::Data;

constexpr const char* format_name = "solenoid-profile-1";

Table times(const ProfileResult& result) {
  const Profile& profile = result.profile;
  Table table{
      .name = "variants",
      .title = fmt::format("Solver time on {}, core {}: least of each instance's passes, percentiles over instances",
                           result.source, profile.core),
      .columns = {Column("name", "variant", "<"), Column("instances", "instances"), Column("p50_us", "p50 us"),
                  Column("p90_us", "p90"), Column("p99_us", "p99"), Column("p999_us", "p99.9"), Column("max_us", "max"),
                  Column("misses", fmt::format("> {:g} ms", profile.period_ms)),
                  Column("limit_misses", fmt::format("> {:g} ms", profile.limit_ms)), Column("", "nodes p50"),
                  Column("", "max"), Column("", "proven %", ".1f%"), Column("", "as recorded"),
                  Column("", "one pass p99.9"), Column("passes", "passes"), Column("one_pass_p50_us"),
                  Column("one_pass_p999_us"), Column("one_pass_max_us")}};
  for (const VariantProfile& p : profile.variants)
    table.add({p.name, p.solve_us.size(), p.time_us.p50, p.time_us.p90, p.time_us.p99, p.time_us.p999, p.time_us.max,
               p.misses, p.limit_misses, p.nodes.p50, p.nodes.max, p.proven_fraction, p.plans_as_recorded,
               p.one_pass_us.p999, p.passes, p.one_pass_us.p50, p.one_pass_us.p999, p.one_pass_us.max});
  return table;
}

/// The bins that hold an instance.
Json bins(const VariantProfile& p) {
  Json list = Json::array();
  for (std::size_t i = 0; i < p.histogram.size(); ++i)
    if (p.histogram[i] > 0) list.push_back({{"from_us", histogram_edge_us(i)}, {"instances", p.histogram[i]}});
  return list;
}

Json counters(const VariantProfile& p) {
  Json object;
  for (std::size_t i = 0; p.counters && i < CounterValues::names.size(); ++i)
    if (p.counters->value[i] >= 0) object[CounterValues::names[i]] = p.counters->value[i];
  return object;
}

/// Beside the times in data; `instances`: with every instance's time.
Table phases(const Profile& profile, bool instances) {
  Table table{
      .name = "variants",
      .title =
          "Where a control period goes: estimate and prepare are medians, the parts of the solve means over "
          "instances",
      .columns = {Column("", "variant", "<"), Column("estimate_us", "estimate us"), Column("prepare_us", "prepare")}};
  for (const char* phase : phase_names)
    table.columns.insert(table.columns.end(), {Column(fmt::format("{}_us", phase)), Column("", phase)});
  table.columns.insert(
      table.columns.end(),
      {Column("other_us", "other"), Column("has_phases"), Column("", "p50 timing off"), Column("timed_p50_us", "on"),
       Column("timing_overhead_percent", "overhead %", ".2f"), Column("nodes_p50"), Column("nodes_p99"),
       Column("nodes_max"), Column("plans_as_recorded"), Column("proven_optimal_fraction"),
       Column("instances_fingerprint"), Column("histogram", "", "", Data::json),
       Column("counters?", "", "", Data::json), Column("solve_us?", "", "", Data::json)});
  for (const VariantProfile& p : profile.variants) {
    Table::Row row{p.name, p.estimate_us, p.prepare_us};
    for (const double us : p.phase_us) row.insert(row.end(), {us, p.has_phases ? Json(us) : Json()});
    row.insert(row.end(), {p.other_us, p.has_phases, p.time_us.p50, p.timed_us.p50, p.overhead_percent, p.nodes.p50,
                           p.nodes.p99, p.nodes.max, p.plans_as_recorded, p.proven_fraction, p.fingerprint, bins(p),
                           counters(p), instances ? Json(p.solve_us) : Json()});
    table.add(std::move(row));
  }
  return table;
}

/// A row a variant, a column a bin: the share of the variant's instances in it.
Table histogram(const Profile& profile) {
  std::size_t first = 99, end = 0;
  for (const VariantProfile& p : profile.variants)
    for (std::size_t i = 0; i < p.histogram.size(); ++i)
      if (p.histogram[i] > 0) first = std::min(first, i), end = std::max(end, i + 1);
  Table table{.title = "Share of instances by time, %", .columns = {{"", "from us", "<"}}};
  for (std::size_t i = first; i < end; ++i)
    table.columns.push_back({"", fmt::format("{:.3g}", std::round(10 * histogram_edge_us(i)) / 10), ".3g%"});
  for (const VariantProfile& p : profile.variants) {
    Table::Row cells = {p.name};
    for (std::size_t i = first; i < end; ++i) {
      const std::size_t n = i < p.histogram.size() ? p.histogram[i] : 0;
      const double share = static_cast<double>(n) / static_cast<double>(std::max<std::size_t>(1, p.solve_us.size()));
      cells.push_back(n == 0 ? Json(".") : Json(share));
    }
    table.add(std::move(cells));
  }
  return table;
}

Table counters_table(const Profile& profile) {
  if (!profile.counters_missing.empty())
    return {.notes = {fmt::format("Hardware counters: none. {}", profile.counters_missing)}};
  Table table{.title = "Hardware counters of one pass, user mode",
              .columns = {Column("", "variant", "<"), Column("", "cycles a solve"), Column("", "instructions"),
                          Column("", "per cycle"), Column("", "branch misses"), Column("", "cache misses"),
                          Column("", "page faults, all")}};
  for (const VariantProfile& p : profile.variants) {
    if (!p.counters) continue;
    const auto& v = p.counters->value;
    const auto n = static_cast<double>(std::max<std::size_t>(1, p.solve_us.size()));
    const auto each = [&](std::size_t i) { return v[i] < 0 ? Json() : Json(static_cast<double>(v[i]) / n); };
    table.add({p.name, each(0), each(1),
               static_cast<double>(v[1]) / static_cast<double>(std::max<std::int64_t>(1, v[0])), each(2), each(3),
               v[4] < 0 ? Json() : Json(v[4])});
  }
  return table;
}

Table quality_table(const ProfileResult& result) {
  Table table{
      .name = "quality",
      .title = "Closed loops with every solve cut at a budget",
      .columns = {Column("variant", "variant", "<"), Column("budget_ms", "budget ms", "g"),
                  Column(result.judged, result.judged_heading), Column("proven_optimal_fraction", "proven %", ".1f%"),
                  Column("late_fraction", "late %", ".2f%"), Column("unstable", "unstable")}};
  for (const QualityPoint& q : result.quality)
    table.add({q.variant, q.budget_ms, q.error, q.proven_fraction, q.late_fraction, q.unstable});
  return table;
}

Table change_table(const ProfileChange& change, double threshold) {
  Table table{.title = "Against the earlier profile",
              .columns = {Column("name", "variant", "<"), Column("typical.ratio", "now / then", ".3f"),
                          Column("typical.low", "95 % from", ".3f"), Column("typical.high", "to", ".3f"),
                          Column("p99.ratio", "p99 now / then", ".3f"), Column("p99.low", "95 % from", ".3f"),
                          Column("p99.high", "to", ".3f"), Column("slower"), Column("", "verdict", "<")}};
  for (const VariantChange& c : change.variants)
    table.add({c.name, c.typical.ratio, c.typical.low, c.typical.high, c.tail.ratio, c.tail.low, c.tail.high, c.slower,
               c.slower ? fmt::format("slower than {:g}", threshold) : "ok"});
  if (!change.only_now.empty()) table.notes.push_back(fmt::format("New: {}", fmt::join(change.only_now, ", ")));
  if (!change.only_then.empty()) table.notes.push_back(fmt::format("Gone: {}", fmt::join(change.only_then, ", ")));
  return table;
}

std::vector<double> times_of(const Json& j) {
  std::vector<double> times = j.at("solve_us").get<std::vector<double>>();
  for (const double t : times)
    if (!(t > 0)) throw std::invalid_argument("a time that is not above 0");
  return times;
}

[[noreturn]] void refuse_profile(const std::string& path, const std::string& problem) {
  throw ConfigError(fmt::format("{}: no profile: {} (allowed: what profile --save wrote)", path, problem));
}

}  // namespace

Result result_of(const ProfileResult& found, bool instances) {
  const Machine machine = this_machine();
  const Profile& profile = found.profile;
  Result result{.facts = {{"format", format_name},
                          {"source", found.source},
                          {"core", profile.core},
                          {"limit_ms", profile.limit_ms},
                          {"machine", {{"cpu", machine.cpu}, {"kernel", machine.kernel}, {"cores", machine.cores}}}},
                .tables = {times(found), phases(profile, instances), histogram(profile), counters_table(profile)}};
  if (!profile.counters_missing.empty()) result.facts["counters_missing"] = profile.counters_missing;
  if (!found.quality.empty()) {
    result.tables.push_back(quality_table(found));
    result.plot = quality_plot(found.quality, found.judged_heading);
  }
  if (!found.change) return result;
  result.tables.push_back(change_table(*found.change, found.threshold));
  result.facts["against"] = {{"threshold", found.threshold},
                             {"variants", result.tables.back().json()},
                             {"only_now", found.change->only_now},
                             {"only_then", found.change->only_then},
                             {"slower", found.change->slower()}};
  return result;
}

Profile read_profile(const std::string& path) {
  const auto text = read_whole_file(path, file_size::json);
  if (!text) throw ConfigError(fmt::format("{}: cannot be read (allowed: what profile --save wrote)", path));
  try {
    const Json all = parse_json(*text, path, "what profile --save wrote");
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
  } catch (const Json::exception& error) {
    refuse_profile(path, problem_with_json(error));
  } catch (const std::invalid_argument& error) {
    refuse_profile(path, error.what());
  }
}

}  // namespace solenoid
