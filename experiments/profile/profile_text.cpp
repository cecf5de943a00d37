#include "experiments/base/text_table.hpp"
#include "experiments/profile/profile_report.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

using Align = TextTable::Align;

std::string times_table(const Profile& profile, bool colour) {
  TextTable table({{"variant", Align::left},
                   {"instances"},
                   {"p50 us"},
                   {"p90"},
                   {"p99"},
                   {"p99.9"},
                   {"max"},
                   {"> 5 ms"},
                   {fmt::format("> {:g} ms", profile.limit_ms)},
                   {"nodes p50"},
                   {"max"},
                   {"proven %"},
                   {"as recorded"},
                   {"one pass p99.9"},
                   {"passes"}});
  for (const VariantProfile& p : profile.variants)
    table.add_row(std::vector<std::string>{
        p.name, fmt::format("{}", p.solve_us.size()), short_number(p.time_us.p50), short_number(p.time_us.p90),
        short_number(p.time_us.p99), short_number(p.time_us.p999), short_number(p.time_us.max),
        fmt::format("{}", p.misses), fmt::format("{}", p.limit_misses), short_number(p.nodes.p50),
        short_number(p.nodes.max), fmt::format("{:.1f}", 100 * p.proven_fraction),
        fmt::format("{}/{}", p.plans_as_recorded, p.solve_us.size()), short_number(p.one_pass_us.p999),
        fmt::format("{}", p.passes)});
  return table.text(colour);
}

std::string phases_table(const Profile& profile, bool colour) {
  TextTable table({{"variant", Align::left},
                   {"estimate us"},
                   {"prepare"},
                   {"rollout"},
                   {"factorisation"},
                   {"bound"},
                   {"other"},
                   {"p50 timing off"},
                   {"on"},
                   {"overhead %"}});
  for (const VariantProfile& p : profile.variants) {
    const auto phase = [&](double us) { return p.has_phases ? short_number(us) : "-"; };
    table.add_row(std::vector<std::string>{p.name, short_number(p.estimate_us), short_number(p.prepare_us),
                                           phase(p.rollout_us), phase(p.factorisation_us), phase(p.bound_us),
                                           short_number(p.other_us), short_number(p.time_us.p50),
                                           short_number(p.timed_us.p50), fmt::format("{:.2f}", p.overhead_percent)});
  }
  return table.text(colour);
}

/// A row a variant, a column a bin; the darkness of a cell is the share of the variant's instances in it.
std::string histogram_text(const Profile& profile) {
  std::size_t first = 99, end = 0, width = 7;
  for (const VariantProfile& p : profile.variants) {
    for (std::size_t i = 0; i < p.histogram.size(); ++i)
      if (p.histogram[i] > 0) first = std::min(first, i), end = std::max(end, i + 1);
    width = std::max(width, p.name.size());
  }
  if (end == 0) return "";
  std::string text = fmt::format("{:{}}", "from us", width);
  for (std::size_t i = first; i < end; ++i)
    text += fmt::format(" {:>6.3g}", std::round(10 * histogram_edge_us(i)) / 10);
  text += "\n";
  for (const VariantProfile& p : profile.variants) {
    std::string row = fmt::format("{:{}}", p.name, width);
    for (std::size_t i = first; i < end; ++i) {
      const std::size_t n = i < p.histogram.size() ? p.histogram[i] : 0;
      const double share = static_cast<double>(n) / static_cast<double>(std::max<std::size_t>(1, p.solve_us.size()));
      row += n == 0 ? "      ." : fmt::format(" {:>5.3g}%", 100 * share);
    }
    text += row.substr(0, row.find_last_not_of(" .") + 1) + "\n";
  }
  return text;
}

std::string counters_text(const Profile& profile, bool colour) {
  if (!profile.counters_missing.empty()) return fmt::format("Hardware counters: none. {}\n", profile.counters_missing);
  TextTable table({{"variant", Align::left},
                   {"cycles a solve"},
                   {"instructions"},
                   {"per cycle"},
                   {"branch misses"},
                   {"cache misses"},
                   {"page faults, all"}});
  for (const VariantProfile& p : profile.variants) {
    if (!p.counters) continue;
    const auto& v = p.counters->value;
    const auto n = static_cast<double>(std::max<std::size_t>(1, p.solve_us.size()));
    const auto each = [&](std::size_t i) { return v[i] < 0 ? "-" : short_number(static_cast<double>(v[i]) / n); };
    table.add_row(std::vector<std::string>{
        p.name, each(0), each(1),
        short_number(static_cast<double>(v[1]) / static_cast<double>(std::max<std::int64_t>(1, v[0]))), each(2),
        each(3), v[4] < 0 ? "-" : fmt::format("{}", v[4])});
  }
  return "Hardware counters of one pass, user mode\n" + table.text(colour);
}

std::string quality_table(const std::vector<QualityPoint>& points, bool colour) {
  TextTable table({{"variant", Align::left}, {"budget ms"}, {"RMSE mm"}, {"proven %"}, {"late %"}, {"unstable"}});
  for (const QualityPoint& q : points)
    table.add_row(std::vector<std::string>{q.variant, fmt::format("{:g}", q.budget_ms), short_number(q.rmse_mm),
                                           fmt::format("{:.1f}", 100 * q.proven_fraction),
                                           fmt::format("{:.2f}", 100 * q.late_fraction),
                                           fmt::format("{}", q.unstable)});
  return table.text(colour);
}

std::string change_table(const ProfileChange& change, double threshold, bool colour) {
  TextTable table({{"variant", Align::left},
                   {"now / then"},
                   {"95 %", Align::left},
                   {"p99 now / then"},
                   {"95 %", Align::left},
                   {"verdict", Align::left}});
  const auto interval = [](const RatioInterval& r) { return fmt::format("{:.3f} to {:.3f}", r.low, r.high); };
  for (const VariantChange& c : change.variants)
    table.add_row(std::vector<std::string>{c.name, fmt::format("{:.3f}", c.typical.ratio), interval(c.typical),
                                           fmt::format("{:.3f}", c.tail.ratio), interval(c.tail),
                                           c.slower ? fmt::format("slower than {:g}", threshold) : "ok"});
  std::string text = table.text(colour);
  if (!change.only_now.empty()) text += fmt::format("New: {}\n", fmt::join(change.only_now, ", "));
  if (!change.only_then.empty()) text += fmt::format("Gone: {}\n", fmt::join(change.only_then, ", "));
  return text;
}

}  // namespace

std::string profile_text(const ProfileResult& result, bool colour) {
  const Profile& p = result.profile;
  std::string text =
      fmt::format("Solver time on {}, core {}: least of each instance's passes, percentiles over instances\n",
                  result.source, p.core);
  text += times_table(p, colour);
  text += "\nWhere a 5 ms cycle goes: estimate and prepare are medians, the parts of the solve means over instances\n" +
          phases_table(p, colour);
  text += "\nShare of instances by time\n" + histogram_text(p) + "\n" + counters_text(p, colour);
  if (!result.quality.empty())
    text += "\nClosed loops with every solve cut at a budget\n" + quality_table(result.quality, colour);
  if (result.change) text += "\nAgainst the earlier profile\n" + change_table(*result.change, result.threshold, colour);
  return text;
}

}  // namespace solenoid
