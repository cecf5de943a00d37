#include "controllers/variant.hpp"

#include "controllers/catalogue.hpp"
#include "controllers/variant_keys.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

void read_model(TableReader& table, VariantConfig& v) {
  if (table.is_table("model")) {
    v.model = "table";
    TableReader parameters = table.table("model");
    v.nominal = read_parameters(parameters);
    return;
  }
  v.model = table.text_or("model", v.model);
  if (v.model.ends_with(".toml")) {
    TableReader parameters = table.file_table("model");
    v.nominal = read_parameters(parameters);
    return;
  }
  try {
    v.nominal = named_parameters(v.model);
  } catch (const std::invalid_argument& error) {
    table.fail("model", fmt::format("{}, or a file of parameters ending in .toml", error.what()));
  }
}

/// What is wrong with the horizon's blocks at this sampling, or nothing.
std::string wrong_blocks(const HorizonSettings& h, const Timing& timing) {
  const int periods = std::accumulate(h.blocks.begin(), h.blocks.end(), 0);
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
  v.timing = with_keys(actuator_description().timing, v.own_timing, table.where("timing"));
  v.estimation.tick_s = v.timing.tick_s;
}

void check_latency(const TableReader& table, const VariantConfig& v) {
  if (v.latency_ticks > v.timing.ticks_per_period)
    table.fail("latency_ticks", fmt::format("{} ticks are longer than a control period (allowed: 0 to {})",
                                            v.latency_ticks, v.timing.ticks_per_period));
}

void check_estimation(TableReader& table, const EstimatorTuning& t) {
  const auto above = [&](const char* high, double high_value, const char* low, double low_value) {
    if (!(low_value < high_value))
      table.table("estimation").fail(high, fmt::format("not above {} (allowed: above {:g})", low, low_value));
  };
  above("position_high_m", t.position_high_m, "position_low_m", t.position_low_m);
  above("pressure_high_pa", t.pressure_high_pa, "pressure_low_pa", t.pressure_low_pa);
}

void read_use_of_estimate(TableReader& table, const EstimatorRow& row, VariantConfig& v) {
  const std::string use =
      table.text_or("use_estimate", "state", {"state", "payload", "disturbance", "payload_and_disturbance"});
  v.use_estimate = {use.starts_with("payload"), use.ends_with("disturbance")};
  if (use != "state" && !row.finds_load)
    table.fail("use_estimate", fmt::format("the estimator '{}' has nothing but the state (allowed: state)", row.name));
}

void check_valves(const TableReader& table, const VariantConfig& v, const std::vector<std::string>& allowed) {
  if (allowed.empty() || std::ranges::count(allowed, v.valves) > 0) return;
  table.fail("valves", fmt::format("'{}' lacks modes that '{}' needs, or has more than it is made for (allowed: {})",
                                   v.valves, v.solver, fmt::join(allowed, ", ")));
}

void check_joint(const TableReader& table, const VariantConfig& v, const SolverRow& row) {
  if (v.motor != "joint" || row.chooses_continuous) return;
  std::vector<std::string> able;
  for (const SolverRow& other : solver_rows())
    if (other.chooses_continuous) able.push_back(other.name);
  table.fail("motor",
             fmt::format("'joint' needs a solver that chooses continuous inputs, not '{}' (allowed solvers: {})",
                         v.solver, fmt::join(able, ", ")));
}

/// Whatever chooses the modes: the keys of its groups and of the estimators, and what it refuses.
template <class Row>
void read_chooser(TableReader& table, const Row& row, VariantConfig& v) {
  std::vector<std::string> groups = row.groups;
  groups.push_back("estimation");
  read_keys(table, groups, v);
  check_estimation(table, v.estimation);
  check_valves(table, v, row.valves);
}

}  // namespace

bool VariantConfig::is_feedback_law() const { return find_row(law_rows(), solver) != nullptr; }

bool VariantConfig::predicts_motor() const {
  if (motor != "joint") return motor == "in_prediction";
  const SolverRow* row = find_row(solver_rows(), solver);
  return !(row && row->plans_whole_force);
}

VariantConfig read_variant(TableReader& table, const std::string& name) {
  VariantConfig v;
  v.name = name;
  read_keys(table, std::vector<std::string>{""}, v);
  const EstimatorRow& estimator = estimator_row(v.estimator);
  v.estimation = estimator.tuning;
  read_timing(table, v);
  read_model(table, v);
  read_use_of_estimate(table, estimator, v);
  if (const LawRow* law = find_row(law_rows(), v.solver)) {
    read_chooser(table, *law, v);
    law->check(table, v);
  } else {
    const SolverRow& row = solver_row(v.solver);
    read_chooser(table, row, v);
    check_blocks(table, v);
    check_latency(table, v);
    check_joint(table, v, row);
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

VariantConfig timed(VariantConfig v, const TimingKeys& scenario, const std::string& where) {
  TimingKeys keys = v.own_timing;
  if (!keys.tick_ms) keys.tick_ms = scenario.tick_ms;
  if (!keys.period_ms) keys.period_ms = scenario.period_ms;
  v.timing = with_keys(actuator_description().timing, keys, where);
  v.estimation.tick_s = v.timing.tick_s;
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
