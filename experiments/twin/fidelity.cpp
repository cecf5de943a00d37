#include "experiments/twin/fidelity.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

struct StepByHorizon {
  int np;
  double overshoot_percent, sse_mm;
};
constexpr StepByHorizon table_5_2[] = {{40, 35.05, 1.19}, {60, 23.53, 0.46}, {80, 5.92, 0.43}, {100, 1.15, 0.89},
                                       {120, 1.14, 2.06}, {140, 0, 3.78},    {160, 0, 5.05},   {180, 0, 6.33},
                                       {200, 0, 8.17},    {220, 0, 9.95}};

struct StepByPayload {
  double payload_kg, dmpc_sse_mm, dmpc_i_sse_mm;  ///< means of five tests, tables 5-3 and 5-4
};
constexpr StepByPayload tables_5_3_and_5_4[] = {{0, 1.28, 0.2}, {0.15, 3.26, 0.4}, {0.46, 4.28, 0.62}};

/// Means of five tests; a steady-state figure of 0 is not in the table.
struct Motion7 {
  const char* table;
  Plane plane;
  const char* trajectory;
  const char* motor;
  double payload_kg, rmse_mm, mae_mm, sse_mm, ssa_mm;
};
constexpr Motion7 tables_7[] = {
    {"7-1", Plane::vertical, "cycloidal", "none", 0, 0.58, 1.96, 0.05, 0.22},
    {"7-2", Plane::vertical, "cycloidal", "pd", 0, 0.08, 0.29, 0.03, 0.10},
    {"7-3", Plane::vertical, "cycloidal", "pd", 0.15, 0.35, 1.61, 0.15, 0.10},
    {"7-4", Plane::vertical, "cycloidal", "pd", 0.46, 0.77, 3.00, 0.14, 0.14},
    {"7-5", Plane::vertical, "sine", "none", 0, 1.62, 3.26, 0, 0},
    {"7-6", Plane::vertical, "sine", "pd", 0, 0.27, 0.97, 0, 0},
    {"7-7", Plane::vertical, "sine", "pd", 0.15, 0.41, 1.28, 0, 0},
    {"7-8", Plane::horizontal, "sine", "pd", 0, 0.52, 1.12, 0, 0},
    {"7-9", Plane::horizontal, "sine", "pd", 0.46, 2.28, 6.25, 0, 0},
};

VariantConfig thesis_variant(const FidelityRig& rig, int np, double integral_gain, const std::string& motor) {
  VariantConfig v;
  v.name = "thesis";
  v.model = rig.believed;
  v.believed = named_parameters(rig.believed);
  v.steps = np;
  v.blocks.clear();
  v.integral.gain = integral_gain;
  v.motor = motor;
  return v;
}

ScenarioConfig scenario(const FidelityRig& rig, const Trajectory& trajectory, Plane plane, double payload_kg) {
  ScenarioConfig s;
  s.plant = rig.plant;
  s.twin = rig.twin;
  s.trajectory = trajectory;
  s.plane = plane;
  s.payload_kg = payload_kg;
  s.noise = true;
  s.ideal_sensing = false;
  s.duration_s = trajectory.duration_s();
  return s;
}

MeasuredMetrics mean_run(const FidelityRig& rig, const VariantConfig& variant, const ScenarioConfig& task) {
  MeasuredMetrics sum;
  const double share = 1.0 / static_cast<double>(rig.seeds.size());
  for (const std::uint64_t seed : rig.seeds) {
    const RunResult run = simulate(variant, task, seed);
    const MeasuredMetrics m = measured_metrics(run.ticks, task.trajectory);
    sum.rmse_mm += share * m.rmse_mm;
    sum.mae_mm += share * m.mae_mm;
    sum.sse_max_abs_mm += share * m.sse_max_abs_mm;
    sum.sse_abs_mean_mm += share * m.sse_abs_mean_mm;
    sum.ssa_mm += share * m.ssa_mm;
    sum.overshoot_percent += share * m.overshoot_percent;
  }
  return sum;
}

/// The step of 5.2.3, from the hanging equilibrium, its last second steady.
Trajectory thesis_step() {
  const double start_m = ActuatorParameters{}.equilibrium_position_m();
  Trajectory step(start_m);
  step.dwell(0.5).step_to(start_m + 0.06, 4.5);
  return step.steady_from(4.0);
}

}  // namespace

MeasuredMetrics measured_metrics(std::span<const TickRecord> ticks, const Trajectory& trajectory) {
  MeasuredMetrics m;
  const double start = trajectory.start_m(), travel = trajectory.at(trajectory.duration_s()).position - start;
  double squares = 0, steady_sum = 0, low = 1e9, high = -1e9, peak = 0;
  int steady = 0;
  for (const TickRecord& t : ticks) {
    const double y = t.decision.estimate[position], error = 1e3 * (t.decision.reference.position - y);
    squares += error * error;
    m.mae_mm = std::max(m.mae_mm, std::abs(error));
    peak = std::max(peak, (y - start) / travel);
    if (!trajectory.steady_from_s() || t.sensors.time_s < *trajectory.steady_from_s()) continue;
    m.sse_max_abs_mm = std::max(m.sse_max_abs_mm, std::abs(error));
    steady_sum += error;
    low = std::min(low, y);
    high = std::max(high, y);
    ++steady;
  }
  m.rmse_mm = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, ticks.size())));
  if (steady == 0) return m;
  m.sse_abs_mean_mm = std::abs(steady_sum) / steady;
  m.ssa_mm = 1e3 * (high - low);
  const double settled = 1.0 - 1e-3 * steady_sum / steady / travel;
  m.overshoot_percent = std::max(0.0, 100 * (peak - settled) / settled);
  return m;
}

std::vector<FidelityCell> chapter5_cells(const FidelityRig& rig) {
  const Trajectory step = thesis_step();
  std::vector<FidelityCell> cells;
  for (const StepByHorizon& row : table_5_2) {
    const MeasuredMetrics m =
        mean_run(rig, thesis_variant(rig, row.np, 0.0, "none"), scenario(rig, step, Plane::vertical, 0.0));
    const std::string name = fmt::format("np={}", row.np);
    cells.push_back({"5-2", name, "overshoot_percent", row.overshoot_percent, m.overshoot_percent});
    cells.push_back({"5-2", name, "sse_mm", row.sse_mm, m.sse_max_abs_mm});
  }
  for (const StepByPayload& row : tables_5_3_and_5_4) {
    const ScenarioConfig task = scenario(rig, step, Plane::vertical, row.payload_kg);
    const std::string name = fmt::format("payload={}", row.payload_kg);
    const MeasuredMetrics plain = mean_run(rig, thesis_variant(rig, 100, 0.0, "none"), task);
    const MeasuredMetrics integral = mean_run(rig, thesis_variant(rig, 100, rig.integral_gain, "none"), task);
    cells.push_back({"5-3", name, "sse_mm", row.dmpc_sse_mm, plain.sse_max_abs_mm});
    cells.push_back({"5-4", name, "sse_mm", row.dmpc_i_sse_mm, integral.sse_max_abs_mm});
  }
  return cells;
}

std::vector<FidelityCell> chapter7_cells(const FidelityRig& rig) {
  const double start_m = ActuatorParameters{}.equilibrium_position_m();
  std::vector<FidelityCell> cells;
  for (const Motion7& row : tables_7) {
    const bool cycloidal = row.trajectory == std::string("cycloidal");
    const ScenarioConfig task =
        scenario(rig, cycloidal ? thesis_cycloidal(start_m) : thesis_sine(start_m), row.plane, row.payload_kg);
    const MeasuredMetrics m = mean_run(rig, thesis_variant(rig, 100, rig.integral_gain, row.motor), task);
    const std::string name = fmt::format("{} {} {} {} kg", row.plane == Plane::vertical ? "vertical" : "horizontal",
                                         row.trajectory, row.motor, row.payload_kg);
    cells.push_back({row.table, name, "rmse_mm", row.rmse_mm, m.rmse_mm});
    cells.push_back({row.table, name, "mae_mm", row.mae_mm, m.mae_mm});
    if (!cycloidal) continue;
    cells.push_back({row.table, name, "sse_mm", row.sse_mm, m.sse_abs_mean_mm});
    cells.push_back({row.table, name, "ssa_mm", row.ssa_mm, m.ssa_mm});
  }
  return cells;
}

double mean_abs_log_ratio(std::span<const FidelityCell> cells,
                          const std::function<bool(const FidelityCell&)>& counted) {
  double sum = 0;
  int n = 0;
  for (const FidelityCell& cell : cells) {
    if (!counted(cell)) continue;
    sum += std::abs(std::log(cell.ours / cell.thesis));
    ++n;
  }
  return n ? sum / n : 0.0;
}

double largest_overshoot(std::span<const FidelityCell> cells, int from_np) {
  double largest = 0;
  for (const FidelityCell& cell : cells)
    if (cell.metric == "overshoot_percent" && std::stoi(cell.case_name.substr(3)) >= from_np)
      largest = std::max(largest, cell.ours);
  return largest;
}

double choice_criterion(std::span<const FidelityCell> cells) {
  double difference = 0;
  int n = 0;
  for (const FidelityCell& cell : cells) {
    if (cell.metric != "overshoot_percent") continue;
    difference += std::abs(cell.ours - cell.thesis) / 10.0;
    ++n;
  }
  return mean_abs_log_ratio(cells, [](const FidelityCell& c) { return c.metric == "sse_mm"; }) + difference / n;
}

}  // namespace solenoid
