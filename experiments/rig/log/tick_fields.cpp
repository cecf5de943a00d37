#include "experiments/rig/log/tick_fields.hpp"

#include "core/config/reader.hpp"

#include <array>
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

#define SOLENOID_FIELD(name, meaning, member, exact)                                  \
  TickField {                                                                         \
    name, meaning, [](const TickRecord& t) { return static_cast<double>(t.member); }, \
        [](TickRecord& t, double v) { assign(t.member, v); }, exact                   \
  }

constexpr std::array fields = {
    SOLENOID_FIELD("time_s", "since the run began", sensors.time_s, true),
    SOLENOID_FIELD("position_m", "measured", sensors.position_m, true),
    SOLENOID_FIELD("pressure_a_pa", "measured, absolute", sensors.pressure_a_pa, true),
    SOLENOID_FIELD("pressure_b_pa", "measured, absolute", sensors.pressure_b_pa, true),
    SOLENOID_FIELD("stale_ticks", "age of the measurement", sensors.stale_ticks, true),
    SOLENOID_FIELD("node_was_safe", "1: the I/O had gone to its safe state", sensors.node_was_safe, true),
    SOLENOID_FIELD("ideal", "1: controllers read the true state", sensors.ideal, true),
    SOLENOID_FIELD("true_position_m", "simulated plants only", sensors.truth[0], true),
    SOLENOID_FIELD("true_velocity_m_s", "simulated plants only", sensors.truth[1], true),
    SOLENOID_FIELD("true_pressure_a_pa", "simulated plants only", sensors.truth[2], true),
    SOLENOID_FIELD("true_pressure_b_pa", "simulated plants only", sensors.truth[3], true),
    SOLENOID_FIELD("reference_m", "desired position", decision.reference.position, true),
    SOLENOID_FIELD("reference_m_s", "desired velocity", decision.reference.velocity, false),
    SOLENOID_FIELD("estimate_m", "position", decision.estimate[0], false),
    SOLENOID_FIELD("estimate_m_s", "velocity", decision.estimate[1], false),
    SOLENOID_FIELD("estimate_a_pa", "pressure", decision.estimate[2], false),
    SOLENOID_FIELD("estimate_b_pa", "pressure", decision.estimate[3], false),
    SOLENOID_FIELD("payload_kg", "estimated", decision.detail.payload_kg, false),
    SOLENOID_FIELD("disturbance_n", "estimated", decision.detail.disturbance_n, false),
    SOLENOID_FIELD("offset_m", "integral offset of the valves' reference", decision.offset_m, false),
    SOLENOID_FIELD("coils_decided", "before the limits, a bit a coil", decision.command.coils, true),
    SOLENOID_FIELD("motor_decided_n", "before the limits", decision.command.motor_force_n, true),
    SOLENOID_FIELD("coils", "written, a bit a coil", applied.coils, true),
    SOLENOID_FIELD("motor_n", "written", applied.motor_force_n, true),
    SOLENOID_FIELD("rung", "0 fresh, 1 shifted, 2 dmpc, 3 motor, 4 safe", decision.rung, true),
    SOLENOID_FIELD("plan_age", "ticks since the plan in force began", decision.plan_age, true),
    TickField{"faults", "seen in this tick, a bit each",
              [](const TickRecord& t) { return static_cast<double>(t.decision.faults.bits()); },
              [](TickRecord& t, double v) { t.decision.faults = FaultSet(static_cast<std::uint64_t>(v)); }, true},
    TickField{"safe_causes", "what latched SAFE, a bit each",
              [](const TickRecord& t) { return static_cast<double>(t.decision.safe_causes.bits()); },
              [](TickRecord& t, double v) { t.decision.safe_causes = FaultSet(static_cast<std::uint64_t>(v)); }, true},
    SOLENOID_FIELD("solved", "1: a plan arrived", decision.solved, true),
    SOLENOID_FIELD("ticket", "tick its problem was posed in", decision.ticket, true),
    SOLENOID_FIELD("solve_status", "0 optimal, 1 feasible, 2 deadline, 3 iterations, 4 infeasible, 5 numerical",
                   decision.report.status, true),
    SOLENOID_FIELD("solve_cost", "of the plan", decision.report.cost, false),
    SOLENOID_FIELD("solve_bound", "proven", decision.report.bound, false),
    SOLENOID_FIELD("solve_nodes", "blocks rolled out, or iterations", decision.report.nodes, true),
    SOLENOID_FIELD("solve_us", "time of the solve", decision.report.time_us, false),
    SOLENOID_FIELD("anticipated", "1: the solve began from a linearisation made before the measurement",
                   decision.report.anticipated, true),
    SOLENOID_FIELD("late_us", "from due to begun", timing.late_us, false),
    SOLENOID_FIELD("read_us", "reading the plant", timing.read_us, false),
    SOLENOID_FIELD("control_us", "controller and limits", timing.control_us, false),
    SOLENOID_FIELD("write_us", "writing the plant", timing.write_us, false),
    SOLENOID_FIELD("skipped", "ticks left out before this one", skipped, true),
};
#undef SOLENOID_FIELD

void append_number(std::string& out, double value, bool exact, const char* none) {
  if (!std::isfinite(value))
    out += none;
  else if (exact)
    fmt::format_to(std::back_inserter(out), "{}", value);
  else
    fmt::format_to(std::back_inserter(out), "{:.6g}", value);
}

}  // namespace

std::span<const TickField> tick_fields() { return fields; }

void tick_json(const TickRecord& tick, std::string& out) {
  out.clear();
  out += '{';
  for (const TickField& field : fields) {
    if (out.size() > 1) out += ',';
    out += '"';
    out += field.name;
    out += "\":";
    append_number(out, field.get(tick), field.exact, "null");
  }
  out += '}';
}

TickRecord tick_from_json(std::string_view json) {
  TickRecord tick;
  try {
    const auto object = nlohmann::json::parse(json);
    for (const TickField& field : fields) {
      const auto value = object.find(field.name);
      if (value == object.end()) continue;
      field.set(tick, value->is_null() ? std::numeric_limits<double>::quiet_NaN() : value->get<double>());
    }
  } catch (const nlohmann::json::exception& error) {
    throw ConfigError(fmt::format("a tick of the log: {} (allowed: the log of `solenoid run`)", error.what()));
  }
  return tick;
}

std::string tick_schema() {
  nlohmann::ordered_json properties;
  for (const TickField& field : fields)
    properties[field.name] = {{"type", nlohmann::json::array({"number", "null"})}, {"description", field.meaning}};
  return nlohmann::ordered_json{{"title", "solenoid.tick"}, {"type", "object"}, {"properties", properties}}.dump();
}

std::string tick_csv_heading() {
  std::string line;
  for (const TickField& field : fields) {
    if (!line.empty()) line += ',';
    line += field.name;
  }
  line += '\n';
  return line;
}

void tick_csv(const TickRecord& tick, std::string& out) {
  bool first = true;
  for (const TickField& field : fields) {
    if (!first) out += ',';
    first = false;
    append_number(out, field.get(tick), field.exact, "");
  }
  out += '\n';
}

std::string tick_csv_text(std::span<const TickRecord> ticks) {
  std::string text = tick_csv_heading();
  for (const TickRecord& tick : ticks) tick_csv(tick, text);
  return text;
}

}  // namespace solenoid
