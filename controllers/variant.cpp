#include "controllers/variant.hpp"

#include "controllers/systems.hpp"
#include "controllers/variant_keys.hpp"
#include "core/config/reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

/// What is wrong with the horizon's blocks at this sampling, or nothing.
std::string wrong_blocks(const HorizonSettings& h, const Timing& timing) {
  const auto periods = std::accumulate(h.blocks.begin(), h.blocks.end(), std::int64_t{0});  // an int would overflow
  if (h.blocks.empty() || periods * timing.ticks_per_period == h.steps) return {};
  return fmt::format(
      "{} periods of {} steps are not the horizon's {} steps (allowed: blocks that add up to "
      "steps / {}, or none for one block)",
      periods, timing.ticks_per_period, h.steps, timing.ticks_per_period);
}

void check_blocks(TableReader& table, const VariantConfig& v) {
  if (const std::string wrong = wrong_blocks(v.horizon, v.timing); !wrong.empty())
    table.table("horizon").fail("blocks", wrong);
}

void read_timing(TableReader& table, VariantConfig& v) {
  v.timing = with_keys(system_of(v).description().timing, v.own_timing, table.where("timing"));
  system_of(v).resample(v);
}

void check_latency(const TableReader& table, const VariantConfig& v) {
  if (v.latency_ticks > v.timing.ticks_per_period)
    table.fail("latency_ticks", fmt::format("{} ticks are longer than a control period (allowed: 0 to {})",
                                            v.latency_ticks, v.timing.ticks_per_period));
}

void check_modes(const TableReader& table, const VariantConfig& v, const std::vector<std::string>& allowed) {
  if (allowed.empty() || std::ranges::count(allowed, v.modes) > 0) return;
  table.fail(system_of(v).description().modes_key,
             fmt::format("'{}' lacks modes that '{}' needs, or has more than it is made for (allowed: {})", v.modes,
                         v.solver, fmt::join(allowed, ", ")));
}

/// Whether the limits make sense together and with the sampling.
void check_limits(TableReader& table, const VariantConfig& v) {
  const LimitSettings& limits = v.limits;
  if (limits == LimitSettings()) return;
  TableReader own = table.table("limits");
  if ((limits.most_changes > 0) != limits.window_ms.has_value())
    own.fail(limits.window_ms ? "most_changes" : "window_ms",
             "missing beside the other one (allowed: both of most_changes, window_ms or neither)");
  const std::vector<Signal>& states = system_of(v).description().states;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const std::string name = limited_state_key(states[i]);
    if (limits.least[i] && limits.most[i] && !(*limits.least[i] < *limits.most[i]))
      own.fail("most_" + name,
               fmt::format("{:g} (allowed: above least_{} = {:g})", *limits.most[i], name, *limits.least[i]));
    if (limits.penalty[i] > 0.0 && !limits.least[i] && !limits.most[i])
      own.fail("penalty_" + states[i].name,
               fmt::format("softens nothing (allowed: beside least_{0} or most_{0})", name));
  }
  try {
    static_cast<void>(SwitchTiming(system_of(v).modes(v), v.timing.tick_s));
  } catch (const std::invalid_argument& wrong) {
    table.fail("limits", wrong.what());
  }
}

/// Whatever chooses the modes: the keys of its groups and of the estimators, and what it refuses.
template <class Row>
void read_chooser(TableReader& table, const Row& row, VariantConfig& v) {
  std::vector<std::string> groups = row.groups;
  groups.push_back("estimation");
  read_keys(table, groups, v);
  system_of(v).check(table, v);
  check_modes(table, v, row.modes);
  if (std::ranges::count(groups, "limits") > 0) check_limits(table, v);
}

}  // namespace

bool VariantConfig::is_feedback_law() const { return find_row(system_of(*this).laws(), solver) != nullptr; }

VariantConfig new_variant(const System* system) {
  if (!system) system = systems().front();
  VariantConfig v = system->defaults();
  for (const AddedKey& key : system->added_keys()) v.added.emplace(key.path, key.usual);
  v.system = system;
  v.timing = system->description().timing;
  system->resample(v);
  return v;
}

VariantConfig read_variant(TableReader& table, const std::string& name) {
  VariantConfig v = new_variant(&read_system(table));
  v.name = name;
  read_keys(table, std::vector<std::string>{""}, v);
  system_of(v).read(table, v);
  read_timing(table, v);
  if (const LawRow* law = find_row(system_of(v).laws(), v.solver)) {
    read_chooser(table, *law, v);
    law->check(table, v);
  } else {
    const SolverRow& row = solver_row(v);
    read_chooser(table, row, v);
    check_blocks(table, v);
    check_latency(table, v);
    row.check(table, v);
  }
  table.finish();
  return v;
}

TimingKeys read_timing_keys(TableReader& table) {
  TimingKeys keys;
  if (table.has("tick_ms")) keys.tick_ms = table.number("tick_ms", tick_range_ms);
  if (table.has("period_ms")) keys.period_ms = table.number("period_ms", period_range_ms);
  table.finish();
  return keys;
}

Timing with_keys(Timing timing, const TimingKeys& keys, const std::string& where) {
  const double period_s = keys.period_ms ? 1e-3 * *keys.period_ms : timing.period_s();
  if (keys.tick_ms) timing.tick_s = 1e-3 * *keys.tick_ms;
  const double ticks = period_s / timing.tick_s;
  if (std::abs(ticks - std::round(ticks)) > 1e-6 || std::round(ticks) < 1)
    throw ConfigError(
        fmt::format("{}: key 'timing': a period of {:g} ms is no whole number of ticks of {:g} ms (allowed: whole "
                    "multiples of the tick)",
                    where, 1e3 * period_s, 1e3 * timing.tick_s));
  timing.ticks_per_period = static_cast<int>(std::round(ticks));
  return timing;
}

TimingKeys said_timing(const VariantConfig& v, const TimingKeys& scenario) {
  TimingKeys keys = v.own_timing;
  if (!keys.tick_ms) keys.tick_ms = scenario.tick_ms;
  if (!keys.period_ms) keys.period_ms = scenario.period_ms;
  return keys;
}

VariantConfig timed(VariantConfig v, const TimingKeys& scenario, const std::string& where) {
  v.timing = with_keys(system_of(v).description().timing, said_timing(v, scenario), where);
  system_of(v).resample(v);
  if (const std::string wrong = wrong_blocks(v.horizon, v.timing); !wrong.empty())
    throw ConfigError(fmt::format("{}: key 'timing': with variant '{}': {}", where, v.name, wrong));
  v.latency_ticks = std::min(v.latency_ticks, v.timing.ticks_per_period);
  return v;
}

bool same_controller(VariantConfig a, VariantConfig b) {
  a.name = b.name = a.summary = b.summary = {};
  return a == b;
}

}  // namespace solenoid
