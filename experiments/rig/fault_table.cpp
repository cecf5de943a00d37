#include "experiments/rig/fault_table.hpp"

#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_guard.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/rig/background.hpp"
#include "experiments/rig/faulty_plant.hpp"
#include "experiments/rig/late_solver.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double rest_s = 1.0, moving_s = 3.5;  // into the cycloid: its dwell, and near its greatest speed

/// Follows a run tick by tick and notes what the fault led to.
struct Observer {
  const ModeSet& modes;
  double fault_s, motor_limit_n;
  FaultOutcome& out;
  FaultSet known{};

  void record(const TickRecord& t) {
    const Decision& d = t.decision;
    out.in_range =
        out.in_range && modes.find(t.applied.switches) >= 0 && std::abs(t.applied.continuous[0]) <= motor_limit_n;
    out.final_command = t.applied;
    out.last = d.rung;
    const double since_ms = 1e3 * (t.sensors.time_s - fault_s);
    if (since_ms < -0.5) {
      known |= d.faults;
      return;
    }
    const bool noticed = (d.faults.bits() & ~known.bits()) != 0 || d.rung != Rung::fresh;
    if (noticed && out.detected_ms < 0) out.detected_ms = since_ms;
    if (out.detected_ms >= 0 && out.acted_ms < 0 && d.rung != Rung::fresh) out.acted_ms = since_ms - out.detected_ms;
    if (d.failed_switch >= 0 && out.note.empty())
      out.note = fmt::format("{} {}", modes.switches()[static_cast<std::size_t>(d.failed_switch)].name,
                             to_string(d.failed_as));
    out.worst = std::max(out.worst, d.rung);
    if (d.rung == Rung::safe) out.causes |= d.safe_causes;
    out.largest_error_mm =
        std::max(out.largest_error_mm, 1e3 * std::abs(d.reference.axis[0].value - t.sensors.truth[position]));
  }
};

}  // namespace

FaultOutcome simulate_fault(const std::string& variant_name, const std::string& name, const std::string& fault,
                            bool moving, double until_s, double rearm_at_s) {
  FaultOutcome out;
  out.name = name;
  out.fault = fault;
  out.moving = moving;
  const std::vector<InjectedFault> faults = parse_faults({fault}, actuator_simulation());
  const Campaign campaign = read_campaign("rig", {{variant_name}, {"cycloidal"}});
  const ScenarioConfig& scenario = campaign.scenarios.front();
  VariantConfig variant = told(campaign.variants.front(), scenario);
  if (fault.starts_with("coil_")) actuator(variant).valve_health = true;
  const double tick_s = variant.timing.tick_s;
  require_real_time(variant);
  FaultyPlant plant(make_plant(variant, scenario, 1), faults, variant, 1);
  const SolverDecorator late = [own = faults_of_solver(faults), tick_s](AnySolverPtr solver) {
    return std::make_unique<LateSolver>(std::move(solver), own, tick_s);
  };
  std::unique_ptr<FallbackLadder> ladder;
  try {
    ladder = make_ladder(variant, scenario.trajectory, actuator_ladder(), late);
  } catch (const std::exception& error) {
    out.note = fmt::format("refused before the first command: {}", error.what());
    return out;
  }
  CommandLimits limits = make_limits(variant);
  const ModeSet modes = system_of(variant).modes(variant);
  Observer observer{modes, faults.front().from_s, actuator(variant).nominal.motor_force_limit_n(), out};
  FakeClock clock;
  ControlLoop loop(plant, clock, *ladder, limits, observer);
  loop.run(variant.timing.ticks_in(until_s), tick_s, [&] {
    if (rearm_at_s >= 0 && std::abs(clock.now_s() - rearm_at_s) < 0.5 * tick_s) ladder->request_rearm();
    return false;
  });
  if (ladder->counts().rearms > 0) out.note = "re-armed";
  if (ladder->counts().refused_rearms > 0) out.note = "re-arm refused";
  return out;
}

std::vector<FaultOutcome> simulated_faults(const std::string& variant) {
  std::vector<FaultOutcome> table;
  const auto add = [&](const std::string& what, bool moving, double for_s = 0.0, double rearm_s = -1.0) {
    const double from_s = moving ? moving_s : rest_s;
    const std::string spec = fmt::format("{}@{}", what, from_s) + (for_s > 0 ? fmt::format("+{}", for_s) : "");
    table.push_back(simulate_fault(variant, what, spec, moving, from_s + (rearm_s > 0 ? rearm_s + 2.0 : 2.0),
                                   rearm_s > 0 ? from_s + rearm_s : -1.0));
  };
  for (const bool moving : {false, true}) {
    for (const char* sensor : {"position", "pressure_a", "pressure_b"}) {
      const bool position = std::string(sensor) == "position";
      for (const char* kind : {"off", "stuck", "garbage", "slow=0.05", "delayed=0.05", "intermittent=0.1"})
        add(fmt::format("{}:{}", sensor, kind), moving);
      add(fmt::format("{}:offset={}", sensor, position ? "0.005" : "30000"), moving);
    }
    for (const char* what : {"valves:stuck", "valves:swapped", "supply:lost"}) add(what, moving);
  }
  for (const char* late : {"1", "2", "5", "10", "20", "50"}) add(fmt::format("solver:late={}", late), true, 0.5);
  for (const char* kind : {"hang", "nan", "throw"}) add(fmt::format("solver:{}", kind), true);
  add("position:garbage", true, 0.3, 0.6);
  add("position:garbage", true, 0.8, 0.6);
  return table;
}

std::vector<FaultOutcome> coil_faults(const std::string& variant_name) {
  std::vector<FaultOutcome> table;
  const VariantConfig variant = shipped_variant(variant_name);
  if (!why_no_valve_health(variant).empty()) return table;
  const ModeSet modes = system_of(variant).modes(variant);
  for (const ActuationFault& kind : actuator_simulation().actuation_faults()) {
    if (kind.of_switch != SwitchFaultKind::stuck_on && kind.of_switch != SwitchFaultKind::stuck_off) continue;
    for (const bool moving : {false, true})
      for (const Switch& coil : modes.switches()) {
        const std::string what = fmt::format("{}:{}", script_name(kind, coil), kind.kind);
        const double from_s = moving ? moving_s : rest_s;
        table.push_back(simulate_fault(variant_name, what, fmt::format("{}@{}", what, from_s), moving, from_s + 2.5));
      }
  }
  return table;
}

Result result_of(const std::vector<FaultOutcome>& simulated, const std::vector<ProcessOutcome>& processes) {
  using Column = Table::Column;
  using Data = Table::Data;
  const auto outputs = [](const Command& c) { return Json{{"coils", c.switches}, {"motor_n", c.continuous[0]}}; };
  const auto outputs_text = [](const Command& c) {
    return fmt::format("{:04b}, {:.1f} N", c.switches, c.continuous[0]);
  };
  const auto happened = [](double ms) { return ms < 0 ? Json() : Json(ms); };
  Table table{.name = "simulated",
              .columns = {Column("", "fault", "<"), Column("fault"), Column("", "when", "<"), Column("moving"),
                          Column("noticed_ms"), Column("", "noticed ms", ".0f"), Column("acted_ms"),
                          Column("", "acted ms", ".0f"), Column("worst_rung", "worst rung", "<"),
                          Column("last_rung", "last rung", "<"), Column("final_outputs", "", "", Data::json),
                          Column("", "final coils, motor", "<"), Column("largest_error_mm", "error mm", ".1f"),
                          Column("in_range", "in range", "<"), Column("safe_causes"), Column("note"),
                          Column("", "why SAFE", "<")}};
  const SystemDescription& system = actuator_description();
  for (const FaultOutcome& f : simulated)
    table.add(
        {f.name, f.fault, f.moving ? "moving" : "at rest", f.moving, f.detected_ms, happened(f.detected_ms), f.acted_ms,
         happened(f.acted_ms), to_string(f.worst, system), to_string(f.last, system), outputs(f.final_command),
         outputs_text(f.final_command), f.largest_error_mm, f.in_range, to_string(f.causes, system), f.note,
         (f.causes.empty() ? std::string() : to_string(f.causes, system)) + (f.note.empty() ? "" : " " + f.note)});
  Table second{
      .name = "processes",
      .columns = {Column("fault", "process", "<"), Column("exit_code", "run's exit"), Column("node_safe_after_ms"),
                  Column("", "node safe after ms", ".1f"), Column("longest_silence_ms", "longest silence ms", ".1f"),
                  Column("final_outputs", "", "", Data::json), Column("", "node's outputs", "<"),
                  Column("refused", "refused"), Column("sessions", "sessions"), Column("asked", "asked too"),
                  Column("noticed_ms"), Column("", "noticed ms", ".0f"), Column("watchdog_resets", "watchdog"),
                  Column("log_ticks", "ticks in the log"), Column("log_closed", "closed", "<"),
                  Column("safe_causes", "why SAFE", "<")}};
  for (const ProcessOutcome& p : processes)
    second.add({p.name, p.exit_code, p.safe_after_ms, happened(p.safe_after_ms), p.longest_silence_ms,
                outputs(p.final_outputs), outputs_text(p.final_outputs), p.refused, p.sessions, p.asked, p.noticed_ms,
                happened(p.noticed_ms), p.watchdog_resets, p.log_ticks, p.log_closed, p.causes});
  return {.tables = {table, second}};
}

}  // namespace solenoid
