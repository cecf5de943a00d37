#include "controllers/systems/actuator/actuator_variant.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "experiments/systems/actuator/thesis/cases.hpp"

#include <fmt/format.h>

namespace solenoid {
namespace {

/// Chapter 6 leaves out the atmosphere on the rod (E9), and its flow (E2) and inertia (E8) are disputed.
const std::vector<std::string>& simulation_parameters() {
  static const std::vector<std::string> sets = {"consistent+no_rod_atmosphere", "printed+inferred+no_rod_atmosphere",
                                                "consistent", "printed"};
  return sets;
}

/// The shipped variant of the thesis's law, believing (and simulated with) `parameters`.
VariantConfig thesis_variant(const std::string& motor, const std::string& parameters) {
  VariantConfig v = shipped_variant(motor == "none" ? "thesis_cylinder" : "thesis_" + motor);
  actuator(v).model = parameters;
  actuator(v).nominal = named_parameters(parameters);
  return v;
}

/// The motion starts where gravity is in balance under these parameters: y_eq of (4.8), 19.70 mm as printed.
ScenarioConfig thesis_scenario(const std::string& kind, double payload_kg, const ActuatorParameters& parameters) {
  const double start_m = parameters.equilibrium_position_m();
  ScenarioConfig s;
  s.name = s.trajectory_kind = kind;
  s.trajectory = kind == "sine" ? thesis_sine(start_m) : thesis_cycloidal(start_m);
  actuator(s).payload_kg = payload_kg;
  s.duration_s = s.trajectory.duration_s();
  return s;
}

Comparison metric(const std::string& name, const PrintedNumber& thesis, const char* key) {
  return {name, thesis, [key](const RunResult& run, const ScenarioConfig&) { return run.metrics[key]; }};
}

std::vector<Comparison> comparisons(const PrintedTable& printed, std::size_t row) {
  std::vector<Comparison> all = {metric("rmse_mm", printed.number(row, "rmse_mm"), "rmse_mm"),
                                 metric("mae_mm", printed.number(row, "mae_mm"), "mae_mm")};
  if (!printed.has_column("sse_mm")) return all;
  const PrintedNumber sse = printed.number(row, "sse_mm");  // both readings of it, E11
  all.push_back(metric("sse_abs_mean_mm", sse, "sse_abs_mean_mm"));
  all.push_back(metric("sse_mean_abs_mm", sse, "sse_mean_abs_mm"));
  all.push_back(metric("ssa_mm", printed.number(row, "ssa_mm"), "ssa_mm"));
  return all;
}

}  // namespace

std::vector<ReproducedCase> simulation_table(const std::string& table) {
  const std::string kind = table == "table-6-1" ? "cycloidal" : "sine";
  const PrintedTable printed =
      PrintedTable::shipped(kind == "sine" ? "table_6-2_sim_vertical_sine" : "table_6-1_sim_vertical_cycloidal");
  std::vector<ReproducedCase> cases;
  for (const std::string& parameters : simulation_parameters())
    for (std::size_t row = 0; row < printed.rows(); ++row) {
      const std::string& motor = printed.text(row, "motor");
      const double payload_kg = printed.number(row, "payload_kg").value;
      ReproducedCase c;
      c.table = table;
      c.parameters = parameters;
      c.variant = thesis_variant(motor, parameters);
      c.name = fmt::format("{}, {} kg", c.variant.name, payload_kg);
      c.scenario = thesis_scenario(kind, payload_kg, actuator(c.variant).nominal);
      c.compared = comparisons(printed, row);
      cases.push_back(std::move(c));
    }
  return cases;
}

}  // namespace solenoid
