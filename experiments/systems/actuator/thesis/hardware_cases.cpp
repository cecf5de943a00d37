#include "controllers/systems/actuator/actuator_variant.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "experiments/systems/actuator/thesis/cases.hpp"
#include "experiments/systems/actuator/thesis/position_figures.hpp"

#include <algorithm>
#include <map>
#include <numeric>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double step_height_m = 0.06;
constexpr double step_at_s = 0.5, hold_s = 4.5;  // the thesis does not say how long a step was held
constexpr double steady_s = 1.0;                 // at the end of hold_s
const char* const nominal = "inferred";

Comparison position_comparison(const std::string& metric, std::optional<PrintedNumber> thesis, PositionSignal signal,
                               double PositionFigures::*value) {
  return {metric, thesis, [signal, value](const RunResult& run, const ScenarioConfig& scenario) {
            return position_figures(run.ticks, scenario.trajectory.axes().front(), signal).*value;
          }};
}

Comparison measured(const std::string& metric, std::optional<PrintedNumber> thesis, double PositionFigures::*value) {
  return position_comparison(metric, thesis, PositionSignal::filtered, value);
}

Comparison of_truth(const std::string& metric, std::optional<PrintedNumber> thesis, double PositionFigures::*value) {
  return position_comparison(metric, thesis, PositionSignal::truth, value);
}

/// Against hardware the measured position is compared; the true one stands beside it (model.md, E13).
std::vector<Comparison> steady_state_comparisons(const PrintedNumber& thesis) {
  return {measured("sse_max_abs_measured_mm", thesis, &PositionFigures::sse_max_abs_mm),
          measured("sse_mean_abs_measured_mm", thesis, &PositionFigures::sse_mean_abs_mm),
          of_truth("sse_max_abs_mm", thesis, &PositionFigures::sse_max_abs_mm)};
}

ReproducedCase hardware_case(const StandIn& rig, const std::string& table, const std::string& name) {
  ReproducedCase c;
  c.table = table;
  c.parameters = rig.name;
  c.name = name;
  actuator(c.variant).model = nominal;
  actuator(c.variant).nominal = named_parameters(nominal);
  c.variant.horizon.blocks.clear();
  actuator(c.scenario).plant = rig.plant;
  actuator(c.scenario).twin = rig.twin;
  c.scenario.noise = true;
  c.scenario.ideal_sensing = false;
  return c;
}

void repeat(ReproducedCase& c, int seeds) {
  c.seeds.resize(static_cast<std::size_t>(seeds));
  std::iota(c.seeds.begin(), c.seeds.end(), 1);
}

ReproducedCase step_case(const StandIn& rig, const std::string& table, const std::string& name, int steps,
                         double integral_gain, double payload_kg) {
  ReproducedCase c = hardware_case(rig, table, name);
  c.variant.name = integral_gain > 0 ? "dmpc_i" : "dmpc";
  c.variant.horizon.steps = steps;
  c.variant.integral.gain = integral_gain;
  c.scenario.name = c.scenario.trajectory_kind = "step";
  c.scenario.trajectory = Trajectory(rig.start_m)
                              .dwell(step_at_s)
                              .step_to(rig.start_m + step_height_m, hold_s)
                              .steady_from(step_at_s + hold_s - steady_s);
  c.scenario.duration_s = c.scenario.trajectory.duration_s();
  actuator(c.scenario).payload_kg = payload_kg;
  repeat(c, rig.step_seeds);
  return c;
}

ReproducedCase horizon_case(const StandIn& rig, const PrintedTable& printed, std::size_t row) {
  const int steps = std::stoi(printed.text(row, "np"));
  ReproducedCase c = step_case(rig, "table-5-2", fmt::format("N_p = {}", steps), steps, 0.0, 0.0);
  c.compared = steady_state_comparisons(printed.number(row, "max_abs_steady_state_error_mm"));
  const PrintedNumber overshoot = printed.number(row, "max_overshoot_percent");
  c.compared.push_back(measured("overshoot_measured_percent", overshoot, &PositionFigures::overshoot_percent));
  c.compared.push_back(of_truth("overshoot_percent", overshoot, &PositionFigures::overshoot_percent));
  return c;
}

PrintedNumber mean_of_tests(const PrintedTable& table, std::size_t row) {
  double sum = 0;
  for (int test = 1; test <= 5; ++test) sum += table.number(row, fmt::format("test_{}", test)).value;
  return {sum / 5, false};
}

ReproducedCase payload_case(const StandIn& rig, const std::string& table, const PrintedTable& printed, std::size_t row,
                            double integral_gain) {
  const double payload_kg = printed.number(row, "payload_kg").value;
  ReproducedCase c = step_case(rig, table, fmt::format("payload {} kg", payload_kg), 100, integral_gain, payload_kg);
  c.compared = steady_state_comparisons(mean_of_tests(printed, row));
  return c;
}

/// Of one motion of chapter 7: what its rows are, by metric, and the case.
ReproducedCase motion_case(const StandIn& rig, const PrintedTable& printed, std::size_t row) {
  const std::string &plane = printed.text(row, "plane"), &kind = printed.text(row, "trajectory"),
                    &motor = printed.text(row, "motor");
  const double payload_kg = printed.number(row, "payload_kg").value;
  ReproducedCase c = hardware_case(rig, "table-" + printed.text(row, "table"),
                                   fmt::format("{} {}, motor {}, {} kg", plane, kind, motor, payload_kg));
  c.variant.name = motor == "none" ? "dmpc_i" : "dmpc_i_" + motor;
  c.variant.horizon.steps = 100;
  c.variant.integral.gain = rig.integral_gain;
  actuator(c.variant).motor = motor;
  c.scenario.name = c.scenario.trajectory_kind = kind;
  c.scenario.trajectory = kind == "sine" ? thesis_sine(rig.start_m) : thesis_cycloidal(rig.start_m);
  c.scenario.duration_s = c.scenario.trajectory.duration_s();
  set_plane(c.scenario, plane == "vertical" ? Plane::vertical : Plane::horizontal);
  actuator(c.scenario).payload_kg = payload_kg;
  repeat(c, rig.motion_seeds);
  return c;
}

/// A motion's steady-state error is read as |mean e| (E11).
double PositionFigures::*figure_of(const std::string& metric) {
  static const std::map<std::string, double PositionFigures::*> figures = {{"rmse", &PositionFigures::rmse_mm},
                                                                           {"mae", &PositionFigures::mae_mm},
                                                                           {"sse", &PositionFigures::sse_abs_mean_mm},
                                                                           {"ssa", &PositionFigures::ssa_mm}};
  return figures.at(metric);
}

void keep(std::vector<ReproducedCase>& cases, const std::string& table) {
  std::erase_if(cases, [&](const ReproducedCase& c) { return c.table != table; });
}

}  // namespace

std::vector<StandIn> stand_ins() {
  const double balanced_m = named_parameters(nominal).equilibrium_position_m();  // 22.11 mm
  const StandIn model{.name = nominal, .plant = "model", .start_m = balanced_m}, twin{.name = "twin"};
  std::vector<StandIn> all = {model, twin, model, twin};
  for (std::size_t i = 2; i < all.size(); ++i) {
    all[i].name += "+integral_per_period";
    all[i].integral_gain /= 5;
  }
  return all;
}

std::vector<ReproducedCase> step_cases(const StandIn& rig) {
  const PrintedTable horizons = PrintedTable::shipped("table_5-2_step_np"),
                     plain = PrintedTable::shipped("table_5-3_step_dmpc_sse_mm"),
                     integral = PrintedTable::shipped("table_5-4_step_dmpc_i_sse_mm");
  std::vector<ReproducedCase> cases;
  for (std::size_t row = 0; row < horizons.rows(); ++row) cases.push_back(horizon_case(rig, horizons, row));
  for (std::size_t row = 0; row < plain.rows(); ++row) cases.push_back(payload_case(rig, "table-5-3", plain, row, 0.0));
  for (std::size_t row = 0; row < integral.rows(); ++row)
    cases.push_back(payload_case(rig, "table-5-4", integral, row, rig.integral_gain));
  return cases;
}

std::vector<ReproducedCase> motion_cases(const StandIn& rig) {
  const PrintedTable printed = PrintedTable::shipped("tables_7-1_to_7-9_experiments");
  std::vector<ReproducedCase> cases;
  for (std::size_t row = 0; row < printed.rows(); ++row) {
    if (cases.empty() || cases.back().table != "table-" + printed.text(row, "table"))
      cases.push_back(motion_case(rig, printed, row));
    const std::string& metric = printed.text(row, "metric");
    cases.back().compared.push_back(
        measured(metric + "_measured_mm", printed.number(row, "mean_mm"), figure_of(metric)));
  }
  for (ReproducedCase& c : cases) c.compared.push_back(of_truth("rmse_mm", std::nullopt, &PositionFigures::rmse_mm));
  return cases;
}

std::vector<ReproducedCase> hardware_table(const std::string& table) {
  std::vector<ReproducedCase> all;
  for (const StandIn& rig : stand_ins()) {
    std::vector<ReproducedCase> cases = table.starts_with("table-7") ? motion_cases(rig) : step_cases(rig);
    keep(cases, table);
    const bool integral = std::ranges::any_of(cases, [](const auto& c) { return c.variant.integral.gain > 0; });
    if (integral || rig.integral_gain == StandIn{}.integral_gain) std::ranges::move(cases, std::back_inserter(all));
  }
  return all;
}

}  // namespace solenoid
