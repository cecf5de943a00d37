#include "experiments/rig/summary.hpp"

#include "experiments/base/table.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

struct Part {
  const char* name;
  Percentiles SessionTiming::*values;
};
constexpr Part parts[] = {{"late", &SessionTiming::late},       {"read", &SessionTiming::read},
                          {"control", &SessionTiming::control}, {"write", &SessionTiming::write},
                          {"tick", &SessionTiming::tick},       {"solve", &SessionTiming::solve}};

std::string timing_table(const SessionTiming& timing) {
  using Column = Table::Column;
  Table table{.columns = {Column("", "us", "<"), Column("", "p50", ".1f"), Column("", "p90", ".1f"),
                          Column("", "p99", ".1f"), Column("", "p99.9", ".1f"), Column("", "max", ".1f")}};
  for (const Part& part : parts) {
    const Percentiles& p = timing.*part.values;
    table.add({part.name, p.p50, p.p90, p.p99, p.p999, p.max});
  }
  return table.text(false);
}

std::string ladder_line(const LadderCounts& counts, const SystemDescription& system) {
  std::string line;
  for (int r = 0; r < rungs; ++r)
    line += fmt::format("{}{} {}", r ? ", " : "", to_string(static_cast<Rung>(r), system),
                        counts.slots[static_cast<std::size_t>(r)]);
  line += fmt::format("; entered SAFE {} times", counts.safe_entries);
  if (counts.rearms + counts.refused_rearms > 0)
    line += fmt::format("; re-armed {}, refused {}", counts.rearms, counts.refused_rearms);
  return line;
}

}  // namespace

std::string status_line(const TickRecord& t, const SystemDescription& system) {
  std::string line = fmt::format("{:7.2f} s ", t.sensors.time_s);
  for (std::size_t a = 0; a < system.axes.size(); ++a) {
    const Axis& axis = system.axes[a];
    const double is = axis.shown_scale * t.sensors.value[axis.channel];
    line += fmt::format(" {} {:7.2f} {}  error {:+6.2f} ", axis.signal.label, is, axis.shown_unit,
                        axis.shown_scale * t.decision.reference.axis[a].value - is);
  }
  line += fmt::format(" {} {:04b}", system.switches_key, t.applied.switches);
  for (std::size_t i = 0; i < system.continuous.size(); ++i)
    line +=
        fmt::format("  {} {:+5.1f} {}", system.continuous[i].label, t.applied.continuous[i], system.continuous[i].unit);
  line += fmt::format("  {}", to_string(t.decision.rung, system));
  if (t.decision.rung == Rung::safe) line += " (" + to_string(t.decision.safe_causes, system) + ")";
  return line;
}

std::string setup_text(std::span<const SetupStep> setup) {
  std::string text;
  for (const SetupStep& step : setup)
    text += fmt::format("{} {}: {}\n", step.granted ? "granted" : "REFUSED", step.what, step.detail);
  return text;
}

std::string session_text(const RunRecord& record, const SessionResult& r) {
  const SystemDescription& system = description_of(record);
  std::string text = fmt::format(
      "{} on {}, seed {}: {} at {:.3f} s\n", record.variant, record.scenario, record.seed,
      r.clean() ? "ended in SAFE as told" : "ended in SAFE (" + to_string(r.causes, system) + ")", r.ended_s);
  std::string metrics;
  for (const MetricColumn& metric : system.metrics)
    if (!metric.heading.empty())
      metrics += fmt::format("{}{} {:.4g}", metrics.empty() ? "" : ", ", metric.heading, r.metrics[metric.key]);
  text += fmt::format("metrics     {}\n", metrics);
  text += fmt::format("ticks       {} done, {} skipped, {} ended late; {} allocations\n", r.loop.ticks, r.loop.skipped,
                      r.loop.late, r.allocations_in_tick);
  text += fmt::format("slots       {}\n", ladder_line(r.ladder, system));
  if (r.ladder.infeasible > 0)
    text += fmt::format("infeasible  {} problems had no plan within the limits, the first {}\n", r.ladder.infeasible,
                        r.infeasible);
  text += fmt::format("commands    {} refused, {} slowed by rates\n", r.refused_commands, r.slowed_commands);
  if (r.io) text += fmt::format("I/O         {}\n", r.io->text());
  if (r.io && r.io->wire) text += fmt::format("wire        {}\n", r.io->wire->text());
  text += fmt::format("log         {}{}\n\n", r.log_path, r.log_problem.empty() ? "" : " INCOMPLETE: " + r.log_problem);
  return text + timing_table(r.timing);
}

std::string repeats_text(std::span<const RunRecord> records) {
  std::string text = fmt::format("\n{} runs, mean and standard deviation:\n", records.size());
  for (const MetricColumn& c : description_of(records.front()).metrics) {
    if (c.heading.empty()) continue;
    double sum = 0.0, squares = 0.0;
    int n = 0;
    for (const RunRecord& r : records) {
      if (!r.metrics) continue;
      const double value = (*r.metrics)[c.key];
      sum += value;
      squares += value * value;
      ++n;
    }
    if (n == 0) return text + "no run has metrics\n";
    const double mean = sum / n, variance = n > 1 ? std::max(0.0, (squares - sum * mean) / (n - 1)) : 0.0;
    text += fmt::format("  {:<18}{:8.3f} +- {:.3f}\n", c.heading, mean, std::sqrt(variance));
  }
  return text;
}

Json session_json(const RunRecord& record, const SessionResult& r) {
  const SystemDescription& system = description_of(record);
  Json json = to_json(record);
  for (const Part& part : parts) {
    const Percentiles& p = r.timing.*part.values;
    json["timing_us"][part.name] = {{"p50", p.p50}, {"p90", p.p90}, {"p99", p.p99}, {"p999", p.p999}, {"max", p.max}};
  }
  json["loop"] = {{"ticks", r.loop.ticks},
                  {"skipped", r.loop.skipped},
                  {"late", r.loop.late},
                  {"allocations", r.allocations_in_tick},
                  {"ended_s", r.ended_s}};
  for (int i = 0; i < rungs; ++i)
    json["ladder"][to_string(static_cast<Rung>(i), system)] = r.ladder.slots[static_cast<std::size_t>(i)];
  if (r.ladder.infeasible > 0) json["infeasible"] = {{"problems", r.ladder.infeasible}, {"first", r.infeasible}};
  json["ladder"]["safe_entries"] = r.ladder.safe_entries;
  json["ladder"]["rearms"] = r.ladder.rearms;
  if (r.io)
    json["io"] = {{"reads", r.io->reads},
                  {"missed", r.io->missed},
                  {"late", r.io->late},
                  {"corrupt", r.io->corrupt},
                  {"write_errors", r.io->write_errors},
                  {"node_timeouts", r.io->node_timeouts},
                  {"asked", r.io->asked},
                  {"displaced", r.io->displaced}};
  if (r.io && r.io->wire) {
    const WireHealth& wire = *r.io->wire;
    json["io"]["wire"] = {{"round_trip_p50_us", wire.round_trip_us.p50},
                          {"round_trip_p99_us", wire.round_trip_us.p99},
                          {"round_trip_max_us", wire.round_trip_us.max},
                          {"jitter_us", wire.jitter_us()},
                          {"age_p99_us", wire.age_us.p99},
                          {"loss", wire.loss()},
                          {"reordered", wire.reordered},
                          {"drift_ppm", wire.drift_ppm},
                          {"clock_error_us", wire.clock_error_us},
                          {"clock_jumps", wire.clock_jumps}};
  }
  json["safe_causes"] = to_string(r.causes, system);
  json["log"] = {{"path", r.log_path}, {"problem", r.log_problem}};
  for (const SetupStep& step : r.setup)
    json["setup"].push_back({{"what", step.what}, {"granted", step.granted}, {"detail", step.detail}});
  return json;
}

}  // namespace solenoid
