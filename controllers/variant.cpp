#include "controllers/variant.hpp"

#include "controllers/catalogue.hpp"
#include "controllers/timing.hpp"
#include "controllers/variant_keys.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/valves.hpp"

#include <algorithm>
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

void check_blocks(TableReader& table, const HorizonSettings& h) {
  const int periods = std::accumulate(h.blocks.begin(), h.blocks.end(), 0);
  if (h.blocks.empty() || periods * ticks_per_period == h.steps) return;
  table.table("horizon").fail(
      "blocks", fmt::format("{} periods of {} steps are not the horizon's {} steps (allowed: blocks that add up to "
                            "steps / {}, or none for one block)",
                            periods, ticks_per_period, h.steps, ticks_per_period));
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
  read_model(table, v);
  read_use_of_estimate(table, estimator, v);
  if (const LawRow* law = find_row(law_rows(), v.solver)) {
    read_chooser(table, *law, v);
    law->check(table, v);
  } else {
    const SolverRow& row = solver_row(v.solver);
    read_chooser(table, row, v);
    check_blocks(table, v.horizon);
    check_joint(table, v, row);
    row.check(table, v);
  }
  table.finish();
  return v;
}

bool same_controller(VariantConfig a, VariantConfig b) {
  a.name = b.name = a.summary = b.summary = {};
  return a == b;
}

}  // namespace solenoid
