#include "experiments/rig/log/tick_fields.hpp"

#include "core/config/reader.hpp"
#include "experiments/rig/log/json_numbers.hpp"

#include <cmath>
#include <iterator>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

template <class T>
void assign(T& target, double value) {
  if constexpr (std::is_integral_v<T> || std::is_enum_v<T>)
    target = std::isfinite(value) ? static_cast<T>(static_cast<std::int64_t>(value)) : T{};
  else
    target = static_cast<T>(value);
}

/// What numbers a log may have of a member.
struct Allowed {
  bool whole;
  double low, high;
};

template <class T>
constexpr Allowed allowed_of(bool exact) {
  constexpr double most = 1e15;  // measured, commanded or desired: whatever the unit, beyond is no measurement
  constexpr double infinite = std::numeric_limits<double>::infinity();
  if (std::is_same_v<T, bool>) return {true, 0, 1};
  if (std::is_same_v<T, Status>) return {true, 0, static_cast<double>(Status::numerical_failure)};
  if (std::is_same_v<T, Rung>) return {true, 0, rungs - 1};
  if (std::is_same_v<T, SwitchPattern>) return {true, 0, static_cast<double>(first_switches(max_switches))};
  if (std::is_integral_v<T>) return {true, -1, sizeof(T) == 4 ? 2147483647.0 : 9007199254740992.0};
  return exact ? Allowed{false, -most, most} : Allowed{false, -infinite, infinite};
}

/// Collects fields; `at(tick)` refers to the member.
struct Fields {
  std::vector<TickField>& all;

  template <class At>
  void add(std::string name, std::string meaning, At at, bool exact) const {
    using T = std::remove_reference_t<decltype(at(std::declval<TickRecord&>()))>;
    const Allowed allowed = allowed_of<T>(exact);
    all.push_back({std::move(name), std::move(meaning),
                   [at](const TickRecord& t) { return static_cast<double>(at(const_cast<TickRecord&>(t))); },
                   [at](TickRecord& t, double v) { assign(at(t), v); }, exact, allowed.whole, allowed.low,
                   allowed.high});
  }
  /// Half of a set of faults.
  template <class At>
  void add_faults(std::string name, std::string meaning, At at, int shift) const {
    constexpr std::uint64_t half = 0xffffffffu;
    all.push_back({std::move(name), std::move(meaning),
                   [at, shift](const TickRecord& t) {
                     return static_cast<double>((at(const_cast<TickRecord&>(t)).bits() >> shift) & half);
                   },
                   [at, shift](TickRecord& t, double v) {
                     FaultSet& set = at(t);
                     set |= FaultSet((static_cast<std::uint64_t>(v) & half) << shift);
                   },
                   true, true, 0, static_cast<double>(half)});
  }
};
#define AT(member) ([=](TickRecord & t) -> auto& { return t.member; })

void add_measurement(const Fields& fields, const SystemDescription& s) {
  fields.add("time_s", "since the run began", AT(sensors.time_s), true);
  fields.all.back().low = 0.0;
  fields.all.back().high = 1e5;  // a day, which `run` does at most, and what may come behind it
  for (std::size_t i = 0; i < s.channels.size(); ++i)
    fields.add(s.channels[i].key, s.channels[i].meaning, AT(sensors.value[i]), true);
  fields.add("stale_ticks", "age of the measurement", AT(sensors.stale_ticks), true);
  fields.add("age_s", "how long before the tick's read began it was measured", AT(sensors.age_s), true);
  fields.add("node_was_safe", "1: the I/O had gone to its safe state", AT(sensors.node_was_safe), true);
  fields.add("ideal", "1: controllers read the true state", AT(sensors.ideal), true);
  for (std::size_t i = 0; i < s.states.size(); ++i)
    fields.add(s.states[i].key, "simulated plants only", AT(sensors.truth[i]), true);
}

void add_decision(const Fields& fields, const SystemDescription& s) {
  const std::size_t axes = s.axes.size();
  for (std::size_t a = 0; a < axes; ++a)
    fields.add(s.reference_keys[a], "desired " + s.axes[a].signal.label, AT(decision.reference.axis[a].value), true);
  for (std::size_t a = 0; a < axes; ++a)
    fields.add(s.reference_keys[axes + a], "desired " + s.axes[a].rate_label, AT(decision.reference.axis[a].rate),
               false);
  for (std::size_t i = 0; i < s.states.size(); ++i)
    fields.add(s.estimate_keys[i], s.states[i].meaning, AT(decision.estimate[i]), false);
  for (std::size_t i = 0; i < s.beliefs.size(); ++i)
    fields.add(s.beliefs[i].key, "estimated", AT(decision.detail.belief[i]), false);
  for (std::size_t a = 0; a < axes; ++a)
    fields.add(s.axes[a].offset_key, "integral offset of the reference of the switches", AT(decision.offset[a]), false);
}

void add_commands(const Fields& fields, const SystemDescription& s) {
  const std::string bits = fmt::format("a bit a {}", s.switch_noun);
  fields.add(s.switches_key + "_decided", "before the limits, " + bits, AT(decision.command.switches), true);
  for (std::size_t i = 0; i < s.continuous.size(); ++i)
    fields.add(s.decided_keys[i], "before the limits", AT(decision.command.continuous[i]), true);
  fields.add(s.switches_key, "written, " + bits, AT(applied.switches), true);
  for (std::size_t i = 0; i < s.continuous.size(); ++i)
    fields.add(s.continuous[i].key, "written", AT(applied.continuous[i]), true);
}

void add_ladder(const Fields& fields, const SystemDescription& s) {
  std::string rung_list;
  for (std::size_t i = 0; i < s.rung_names.size(); ++i)
    rung_list += fmt::format("{}{} {}", i ? ", " : "", i, s.rung_names[i]);
  fields.add("rung", rung_list, AT(decision.rung), true);
  fields.add("plan_age", "ticks since the plan in force began", AT(decision.plan_age), true);
  fields.add_faults("faults", "seen in this tick, a bit each", AT(decision.faults), 0);
  fields.add_faults("safe_causes", "what latched SAFE, a bit each", AT(decision.safe_causes), 0);
  fields.add("failed_switch", fmt::format("the {} that was found to have failed, from 0; -1: none", s.switch_noun),
             AT(decision.failed_switch), true);
  fields.add("mode_set", "which switches are commanded: 0 all, else a set of those that are left",
             AT(decision.mode_set), true);
  fields.add_faults("faults_more", "of the channels from the fourth on and of switches", AT(decision.faults), 32);
  fields.add_faults("safe_causes_more", "of the channels from the fourth on and of switches", AT(decision.safe_causes),
                    32);
}

void add_solve(const Fields& fields) {
  fields.add("solved", "1: a plan arrived", AT(decision.solved), true);
  fields.add("ticket", "tick its problem was posed in", AT(decision.ticket), true);
  fields.add("solve_status", "0 optimal, 1 feasible, 2 deadline, 3 iterations, 4 infeasible, 5 numerical",
             AT(decision.report.status), true);
  fields.add("solve_cost", "of the plan", AT(decision.report.cost), false);
  fields.add("solve_bound", "proven", AT(decision.report.bound), false);
  fields.add("solve_nodes", "blocks rolled out, or iterations", AT(decision.report.nodes), true);
  fields.add("solve_us", "time of the solve", AT(decision.report.time_us), false);
  fields.add("anticipated", "1: the solve began from a linearisation made before the measurement",
             AT(decision.report.anticipated), true);
}

void add_timing(const Fields& fields) {
  fields.add("late_us", "from due to begun", AT(timing.late_us), false);
  fields.add("read_us", "reading the plant", AT(timing.read_us), false);
  fields.add("control_us", "controller and limits", AT(timing.control_us), false);
  fields.add("write_us", "writing the plant", AT(timing.write_us), false);
  fields.add("skipped", "ticks left out before this one", AT(skipped), true);
}
#undef AT

void append_number(std::string& out, double value, bool exact, const char* none) {
  if (!std::isfinite(value))
    out += none;
  else if (exact)
    fmt::format_to(std::back_inserter(out), "{}", value);
  else
    fmt::format_to(std::back_inserter(out), "{:.6g}", value);
}

}  // namespace

std::optional<std::string> TickField::refusal(double value) const {
  const bool missing = !whole && std::isnan(value) && name != "time_s";
  if (missing || (value >= low && value <= high && (!whole || value == std::floor(value)))) return std::nullopt;
  return whole ? fmt::format("a whole number from {} to {}", low, high) : fmt::format("{} to {}", low, high);
}

TickFormat::TickFormat(const SystemDescription& system) : system_(&system) {
  const Fields fields{fields_};
  add_measurement(fields, system);
  add_decision(fields, system);
  add_commands(fields, system);
  add_ladder(fields, system);
  add_solve(fields);
  add_timing(fields);
  for (std::size_t i = 0; i < fields_.size(); ++i) places_.emplace(fields_[i].name, i);
  needed_ = {places_.at("time_s"), places_.at(system.switches_key)};
  for (const Signal& channel : system.channels) needed_.push_back(places_.at(channel.key));
}

void TickFormat::json(const TickRecord& tick, std::string& out) const {
  out.clear();
  out += '{';
  for (const TickField& field : fields_) {
    if (out.size() > 1) out += ',';
    out += '"';
    out += field.name;
    out += "\":";
    append_number(out, field.get(tick), field.exact, "null");
  }
  out += '}';
}

std::optional<std::size_t> TickFormat::find(const std::string& name, std::size_t expected) const {
  if (expected < fields_.size() && fields_[expected].name == name) return expected;
  const auto place = places_.find(name);
  if (place == places_.end()) return std::nullopt;
  return place->second;
}

TickRecord TickFormat::from_json(std::string_view json) const {
  TickRecord tick;
  std::string wrong;
  std::vector<bool> said(fields_.size());
  std::size_t expected = 0;
  const auto problem = read_json_numbers(json, [&](const std::string& name, double value) {
    const auto place = find(name, expected);
    if (!place || !wrong.empty()) return;  // of a later version
    const TickField& field = fields_[*place];
    if (said[*place]) wrong = fmt::format("key '{}' twice (allowed: once)", name);
    if (const auto allowed = field.refusal(value))
      wrong = fmt::format("key '{}': {} (allowed: {})", name, value, *allowed);
    if (wrong.empty()) field.set(tick, value);
    said[*place] = true;
    expected = *place + 1;
  });
  if (problem) throw ConfigError(fmt::format("{} (allowed: a tick of `solenoid run`)", *problem));
  if (!wrong.empty()) throw ConfigError(wrong);
  for (const std::size_t place : needed_)
    if (!said[place])
      throw ConfigError(fmt::format("no key '{}' (allowed: a tick of `solenoid run`)", fields_[place].name));
  return tick;
}

std::string TickFormat::schema() const {
  nlohmann::ordered_json properties;
  for (const TickField& field : fields_)
    properties[field.name] = {{"type", nlohmann::json::array({"number", "null"})}, {"description", field.meaning}};
  return nlohmann::ordered_json{{"title", "solenoid.tick"}, {"type", "object"}, {"properties", properties}}.dump();
}

std::string TickFormat::csv_heading() const {
  std::string line;
  for (const TickField& field : fields_) {
    if (!line.empty()) line += ',';
    line += field.name;
  }
  line += '\n';
  return line;
}

void TickFormat::csv(const TickRecord& tick, std::string& out) const {
  bool first = true;
  for (const TickField& field : fields_) {
    if (!first) out += ',';
    first = false;
    append_number(out, field.get(tick), field.exact, "");
  }
  out += '\n';
}

std::string TickFormat::csv_text(std::span<const TickRecord> ticks) const {
  std::string text = csv_heading();
  for (const TickRecord& tick : ticks) csv(tick, text);
  return text;
}

}  // namespace solenoid
