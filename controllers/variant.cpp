#include "controllers/variant.hpp"

#include "controllers/baselines/read_law.hpp"
#include "controllers/timing.hpp"
#include "core/actuator/valves.hpp"
#include "core/config/reader.hpp"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>

namespace solenoid {

const std::vector<std::string>& VariantChoices::estimators() {
  static const std::vector<std::string> names = {"thesis", "ekf", "payload_ekf", "mhe"};
  return names;
}
const std::vector<std::string>& VariantChoices::estimate_uses() {
  static const std::vector<std::string> names = {"state", "payload", "disturbance", "payload_and_disturbance"};
  return names;
}
const std::vector<std::string>& VariantChoices::solvers() {
  static const std::vector<std::string> names = {
      "exhaustive", "branch_and_bound", "extended_cost", "sum_up_rounding", "cia", "bonmin"};
  return names;
}
const std::vector<std::string>& VariantChoices::relaxed_solvers() {
  static const std::vector<std::string> names = {"sqp", "ipopt"};
  return names;
}
const std::vector<std::string>& VariantChoices::laws() {
  static const std::vector<std::string> names = {"pulse_width_pid", "three_mode_sliding", "switching_hybrid"};
  return names;
}
bool VariantConfig::lawful() const { return std::ranges::count(VariantChoices::laws(), solver) > 0; }
bool VariantConfig::relaxed() const { return std::ranges::count(VariantChoices::relaxed_solvers(), solver) > 0; }
const std::vector<std::string>& VariantChoices::motors() {
  static const std::vector<std::string> names = {"none", "pd", "inverse_dynamics", "in_prediction", "joint"};
  return names;
}

namespace {

void read_model(TableReader& table, VariantConfig& v) {
  if (table.is_table("model")) {
    v.model = "table";
    TableReader parameters = table.table("model");
    v.believed = read_parameters(parameters);
    return;
  }
  v.model = table.text_or("model", v.model);
  if (v.model.ends_with(".toml")) {
    TableReader parameters = table.file_table("model");
    v.believed = read_parameters(parameters);
    return;
  }
  try {
    v.believed = named_parameters(v.model);
  } catch (const std::invalid_argument& error) {
    table.fail("model", fmt::format("{}, or a file of parameters ending in .toml", error.what()));
  }
}

void read_horizon(TableReader& table, VariantConfig& v) {
  if (!table.has("horizon")) return;
  TableReader horizon = table.table("horizon");
  v.steps = horizon.integer_or("steps", v.steps, 1, 1000);
  v.blocks = horizon.has("blocks") ? horizon.integers("blocks", 1, 200) : std::vector<int>{};
  horizon.finish();
  if (v.blocks.empty()) return;
  const int periods = std::accumulate(v.blocks.begin(), v.blocks.end(), 0);
  if (periods * ticks_per_period != v.steps)
    horizon.fail("blocks",
                 fmt::format("{} periods of {} steps are not the horizon's {} steps (allowed: blocks that add "
                             "up to steps / {}, or none for one block)",
                             periods, ticks_per_period, v.steps, ticks_per_period));
}

void read_cost(TableReader& table, VariantConfig& v) {
  if (!table.has("cost")) return;
  TableReader cost = table.table("cost");
  const Range weight = Range::non_negative();
  v.position_weight = cost.number_or("position", v.position_weight, weight);
  v.velocity_weight = cost.number_or("velocity", v.velocity_weight, weight);
  v.switching_weight = cost.number_or("switching", v.switching_weight, weight);
  v.air_weight = cost.number_or("air", v.air_weight, weight);
  v.terminal_position_weight = cost.number_or("terminal_position", v.terminal_position_weight, weight);
  v.terminal_velocity_weight = cost.number_or("terminal_velocity", v.terminal_velocity_weight, weight);
  v.motor_weight = cost.number_or("motor", v.motor_weight, weight);
  if (v.solver == "extended_cost")
    v.terminal_acceleration_weight = cost.number_or("terminal_acceleration", 0.0, weight);
  cost.finish();
}

void read_rounding(TableReader& table, VariantConfig& v) {
  if (!table.has("rounding")) return;
  TableReader rounding = table.table("rounding");
  v.rounding_improves = rounding.boolean_or("improve", v.rounding_improves);
  v.relaxing_iterations = rounding.integer_or("iterations", v.relaxing_iterations, 0, 10000);
  rounding.finish();
}

void read_integral(TableReader& table, VariantConfig& v) {
  if (!table.has("integral")) return;
  TableReader integral = table.table("integral");
  v.integral.gain = integral.number_or("gain", v.integral.gain, Range::non_negative());
  v.integral.forgetting = integral.number_or("forgetting", v.integral.forgetting, Range::between(0.0, 1.0));
  v.integral.limit_m = integral.number_or("limit_m", v.integral.limit_m, Range::positive());
  integral.finish();
}

void read_motor(TableReader& table, VariantConfig& v) {
  v.motor = table.text_or("motor", v.motor, VariantChoices::motors());
  if (v.motor == "joint" && (v.solver == "exhaustive" || v.solver == "branch_and_bound" || v.solver == "extended_cost"))
    table.fail("motor", fmt::format("'joint' needs a solver that chooses continuous inputs, not '{}' (allowed solvers: "
                                    "sum_up_rounding, cia, bonmin, sqp, ipopt)",
                                    v.solver));
  if (!table.has("motor_gains")) return;
  TableReader gains = table.table("motor_gains");
  v.motor_gains.proportional = gains.number_or("proportional", v.motor_gains.proportional, Range::non_negative());
  v.motor_gains.derivative = gains.number_or("derivative", v.motor_gains.derivative, Range::non_negative());
  gains.finish();
}

void read_estimator(TableReader& table, VariantConfig& v) {
  v.estimator = table.text_or("estimator", v.estimator, VariantChoices::estimators());
  v.estimation = estimator_tuning(v.estimator);
  if (table.has("estimation")) {
    TableReader estimation = table.table("estimation");
    read_estimator_tuning(estimation, v.estimation);
  }
  const std::string use = table.text_or("use_estimate", "state", VariantChoices::estimate_uses());
  v.use_estimate = {use.starts_with("payload"), use.ends_with("disturbance")};
  if ((v.use_estimate.payload || v.use_estimate.disturbance) && v.estimator == "thesis")
    table.fail("use_estimate", "the estimator 'thesis' has nothing but the state (allowed: state)");
}

/// What is left of a variant without a solver: its law, and no key that a law has no use for.
VariantConfig read_law_variant(TableReader& table, VariantConfig v) {
  read_model(table, v);
  read_motor(table, v);
  read_law(table, v);
  table.finish();
  return v;
}

}  // namespace

VariantConfig read_variant(TableReader& table, const std::string& name) {
  VariantConfig v;
  v.name = name;
  v.summary = table.text_or("summary", "");
  v.valves = table.text_or("valves", v.valves, valve_configurations());
  read_estimator(table, v);
  std::vector<std::string> solvers = VariantChoices::solvers();
  for (const auto* more : {&VariantChoices::relaxed_solvers(), &VariantChoices::laws()})
    solvers.insert(solvers.end(), more->begin(), more->end());
  v.solver = table.text_or("solver", v.solver, solvers);
  if (v.lawful()) return read_law_variant(table, v);
  v.latency_ticks = table.integer_or("latency_ticks", 0, 0, ticks_per_period);
  if (table.has("deadline_ms")) v.deadline_ms = table.number("deadline_ms", Range::positive());
  read_model(table, v);
  read_horizon(table, v);
  read_cost(table, v);
  read_integral(table, v);
  read_motor(table, v);
  read_rounding(table, v);
  if (v.relaxed() && v.latency_ticks != 0)
    table.fail("latency_ticks", fmt::format("the solver '{}' works without latency (allowed: 0)", v.solver));
  if (v.solver == "extended_cost" && v.blocks.size() > 1 && v.valves == "three_way")
    table.fail("valves",
               "extended_cost with more than one block closes every valve after the first (allowed: two_way, "
               "three_mode, seven_mode)");
  table.finish();
  return v;
}

}  // namespace solenoid
