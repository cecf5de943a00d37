#include "experiments/thesis/cases.hpp"
#include "experiments/thesis/step_figures.hpp"

#include <numeric>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double step_height_m = 0.06;
constexpr double step_at_s = 0.5, hold_s = 4.5;  // the thesis does not say how long a step was held
constexpr double steady_s = 1.0;                 // at the end of hold_s
constexpr int seeds = 10;
const char* const step_parameters = "inferred";

double figure(const RunResult& run, const ScenarioConfig& scenario, PositionSignal signal, double StepFigures::*value) {
  return step_figures(run.ticks, scenario.trajectory, signal).*value;
}

Comparison step_comparison(const std::string& metric, std::optional<PrintedNumber> thesis, PositionSignal signal,
                           double StepFigures::*value) {
  return {metric, thesis, [signal, value](const RunResult& run, const ScenarioConfig& scenario) {
            return figure(run, scenario, signal, value);
          }};
}

/// Against hardware the measured position is compared; the true one stands beside it (model.md, E13).
std::vector<Comparison> steady_state_comparisons(const PrintedNumber& thesis) {
  const auto filtered = PositionSignal::filtered, truth = PositionSignal::truth;
  return {step_comparison("sse_max_abs_measured_mm", thesis, filtered, &StepFigures::max_abs_error_mm),
          step_comparison("sse_mean_abs_measured_mm", thesis, filtered, &StepFigures::mean_abs_error_mm),
          step_comparison("sse_max_abs_mm", thesis, truth, &StepFigures::max_abs_error_mm)};
}

ReproducedCase step_case(const std::string& table, const std::string& name, int steps, double integral_gain,
                         double payload_kg) {
  ReproducedCase c;
  c.table = table;
  c.parameters = step_parameters;
  c.name = name;
  c.variant.name = integral_gain > 0 ? "dmpc_i" : "dmpc";
  c.variant.model = step_parameters;
  c.variant.believed = named_parameters(step_parameters);
  c.variant.steps = steps;
  c.variant.blocks.clear();
  c.variant.integral.gain = integral_gain;
  c.scenario.name = "step";
  c.scenario.trajectory_kind = "step";
  const double start_m = c.variant.believed.equilibrium_position_m();
  c.scenario.trajectory = Trajectory(start_m).dwell(step_at_s).step_to(start_m + step_height_m, hold_s);
  c.scenario.trajectory.steady_from(step_at_s + hold_s - steady_s);
  c.scenario.payload_kg = payload_kg;
  c.scenario.noise = true;
  c.scenario.ideal_sensing = false;
  c.scenario.duration_s = c.scenario.trajectory.duration_s();
  c.seeds.resize(seeds);
  std::iota(c.seeds.begin(), c.seeds.end(), 1);
  return c;
}

PrintedNumber mean_of_tests(const PrintedTable& table, std::size_t row) {
  double sum = 0;
  for (int test = 1; test <= 5; ++test) sum += table.number(row, fmt::format("test_{}", test)).value;
  return {sum / 5, false};
}

std::vector<ReproducedCase> payload_table(const std::string& name, const std::string& file, double integral_gain) {
  const PrintedTable printed = PrintedTable::shipped(file);
  std::vector<ReproducedCase> cases;
  for (std::size_t row = 0; row < printed.rows(); ++row) {
    const double payload_kg = printed.number(row, "payload_kg").value;
    cases.push_back(step_case(name, fmt::format("payload {} kg", payload_kg), 100, integral_gain, payload_kg));
    cases.back().compared = steady_state_comparisons(mean_of_tests(printed, row));
  }
  return cases;
}

}  // namespace

std::vector<ReproducedCase> table_5_2() {
  const PrintedTable printed = PrintedTable::shipped("table_5-2_step_np");
  std::vector<ReproducedCase> cases;
  for (std::size_t row = 0; row < printed.rows(); ++row) {
    const int steps = std::stoi(printed.text(row, "np"));
    ReproducedCase c = step_case("table-5-2", fmt::format("N_p = {}", steps), steps, 0.0, 0.0);
    c.compared = steady_state_comparisons(printed.number(row, "max_abs_steady_state_error_mm"));
    const PrintedNumber overshoot = printed.number(row, "max_overshoot_percent");
    c.compared.push_back(step_comparison("overshoot_measured_percent", overshoot, PositionSignal::filtered,
                                         &StepFigures::overshoot_percent));
    c.compared.push_back(
        step_comparison("overshoot_percent", overshoot, PositionSignal::truth, &StepFigures::overshoot_percent));
    cases.push_back(std::move(c));
  }
  return cases;
}

std::vector<ReproducedCase> table_5_3() { return payload_table("table-5-3", "table_5-3_step_dmpc_sse_mm", 0.0); }
std::vector<ReproducedCase> table_5_4() { return payload_table("table-5-4", "table_5-4_step_dmpc_i_sse_mm", 0.005); }

}  // namespace solenoid
