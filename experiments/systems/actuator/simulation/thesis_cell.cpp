#include "experiments/systems/actuator/simulation/thesis_cell.hpp"

#include "controllers/systems/actuator/actuator_variant.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"

#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr const char* simulated_cycloidal = "table_6-1_sim_vertical_cycloidal";
constexpr const char* simulated_sine = "table_6-2_sim_vertical_sine";
constexpr const char* measured = "tables_7-1_to_7-9_experiments";

/// The thesis's law by its motor, in the tables' words; empty for another controller.
std::string motor_of_law(const VariantConfig& v) {
  VariantConfig thesis = shipped_variant("thesis_cylinder");
  actuator(thesis).motor = actuator(v).motor;
  if (!same_controller(v, thesis)) return {};
  if (actuator(v).motor == "none" || actuator(v).motor == "pd") return actuator(v).motor;
  return actuator(v).motor == "inverse_dynamics" ? "id" : "";
}

bool same_motion(const Trajectory& a, const Trajectory& b) {
  constexpr double step_s = 0.05, near_m = 1e-6;
  if (std::abs(a.duration_s() - b.duration_s()) > 1e-9) return false;
  for (double t = 0.0; t <= a.duration_s(); t += step_s)
    if (std::abs(a.at(t).value - b.at(t).value) > near_m) return false;
  return true;
}

/// "cycloidal", "sine", or empty for a motion that is not the thesis's.
std::string motion_of(const ScenarioConfig& s) {
  constexpr double near_m = 3e-3;  // starts of 19.7 mm, and of 22.1 mm where another inertia is inferred
  const Trajectory& motion = s.trajectory.axes().front();
  const double start_m = motion.start();
  if (std::abs(start_m - ActuatorParameters{}.equilibrium_position_m()) > near_m) return {};
  if (s.duration_s != motion.duration_s() || actuator(s).kick) return {};
  if (same_motion(motion, thesis_cycloidal(start_m))) return "cycloidal";
  return same_motion(motion, thesis_sine(start_m)) ? "sine" : "";
}

std::optional<ThesisCell> simulated_cell(const std::string& motion, const std::string& motor, double payload_kg) {
  const bool cycloidal = motion == "cycloidal";
  const PrintedTable table = PrintedTable::shipped(cycloidal ? simulated_cycloidal : simulated_sine);
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (table.text(row, "motor") != motor || table.number(row, "payload_kg").value != payload_kg) continue;
    ThesisCell cell{cycloidal ? "6-1" : "6-2",   false, table.number(row, "rmse_mm"),
                    table.number(row, "mae_mm"), {},    {}};
    if (cycloidal) cell.sse_mm = table.number(row, "sse_mm");
    if (cycloidal) cell.ssa_mm = table.number(row, "ssa_mm");
    return cell;
  }
  return std::nullopt;
}

std::optional<ThesisCell> measured_cell(const std::string& plane, const std::string& motion, const std::string& motor,
                                        double payload_kg) {
  const PrintedTable table = PrintedTable::shipped(measured);
  std::optional<ThesisCell> cell;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (table.text(row, "plane") != plane || table.text(row, "trajectory") != motion ||
        table.text(row, "motor") != motor || table.number(row, "payload_kg").value != payload_kg)
      continue;
    if (!cell) cell = ThesisCell{table.text(row, "table"), true, {}, {}, {}, {}};
    const std::string& metric = table.text(row, "metric");
    const PrintedNumber mean = table.number(row, "mean_mm");
    if (metric == "rmse") cell->rmse_mm = mean;
    if (metric == "mae") cell->mae_mm = mean;
    if (metric == "sse") cell->sse_mm = mean;
    if (metric == "ssa") cell->ssa_mm = mean;
  }
  return cell;
}

}  // namespace

std::optional<ThesisCell> thesis_cell(const VariantConfig& variant, const ScenarioConfig& scenario) {
  if (!(actuator(scenario).mismatch == Mismatch{})) return std::nullopt;
  const std::string motor = motor_of_law(variant), motion = motion_of(scenario);
  if (motor.empty() || motion.empty()) return std::nullopt;
  const bool vertical = actuator(scenario).plane == Plane::vertical;
  if (actuator(scenario).plant == "twin")
    return measured_cell(vertical ? "vertical" : "horizontal", motion, motor, actuator(scenario).payload_kg);
  return vertical ? simulated_cell(motion, motor, actuator(scenario).payload_kg) : std::nullopt;
}

}  // namespace solenoid
