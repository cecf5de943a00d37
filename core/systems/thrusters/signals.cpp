#include "core/systems/thrusters/signals.hpp"

#include "core/metrics/tracking.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace solenoid {
namespace {

constexpr double degrees_a_radian = 180.0 / std::numbers::pi;

Axis pose_axis(const char* name, const char* unit, const char* label, const char* key, std::size_t index) {
  Axis axis;
  axis.signal = {name, unit, key, label, "desired"};
  axis.shown_unit = index < 2 ? "mm" : "deg";
  axis.shown_scale = index < 2 ? 1e3 : degrees_a_radian;
  axis.rate_label = index < 2 ? "velocity" : "rate";
  axis.offset_key = std::string("offset_") + name;
  axis.approach = index < 2 ? 0.05 : 0.1;
  axis.state = axis.channel = index;
  return axis;
}

SystemDescription described_thrusters() {
  SystemDescription s;
  s.name = "thrusters";
  s.summary = "a planar free-flyer on air bearings with eight on/off thrusters, after ESA's REACSA";
  s.states = {{"x", "m", "true_x_m", "x", "position"},
              {"y", "m", "true_y_m", "y", "position"},
              {"angle", "rad", "true_angle_rad", "angle", "of the body"},
              {"vx", "m/s", "true_vx_m_s", "velocity x", "velocity"},
              {"vy", "m/s", "true_vy_m_s", "velocity y", "velocity"},
              {"rate", "rad/s", "true_rate_rad_s", "rate", "of turn"}};
  s.estimate_keys = {"estimate_x_m",    "estimate_y_m",    "estimate_angle_rad",
                     "estimate_vx_m_s", "estimate_vy_m_s", "estimate_rate_rad_s"};
  s.channels = {{"x", "m", "x_m", "x", "measured"},
                {"y", "m", "y_m", "y", "measured"},
                {"angle", "rad", "angle_rad", "angle", "measured"}};
  s.beliefs = {{"ax", "m/s2", "outside_ax_m_s2", "acceleration x from outside"},
               {"ay", "m/s2", "outside_ay_m_s2", "acceleration y from outside"},
               {"turn", "rad/s2", "outside_turn_rad_s2", "angular acceleration from outside"}};
  s.axes = {pose_axis("x", "m", "x", "reference_x_m", 0), pose_axis("y", "m", "y", "reference_y_m", 1),
            pose_axis("angle", "rad", "angle", "reference_angle_rad", 2)};
  s.reference_keys = {"reference_x_m",    "reference_y_m",    "reference_angle_rad",
                      "reference_vx_m_s", "reference_vy_m_s", "reference_rate_rad_s"};
  s.outputs = {{0, 0, "x", "1/m2"},   {1, 0, "y", "1/m2"},   {2, 0, "angle", "1/rad2"},
               {0, 1, "vx", "s2/m2"}, {1, 1, "vy", "s2/m2"}, {2, 1, "rate", "s2/rad2"}};
  s.metrics = {{.key = "rmse_mm", .heading = "RMSE mm"},
               {.key = "largest_mm", .heading = "largest mm"},
               {.key = "rmse_deg", .heading = "RMSE deg"},
               {.key = "largest_deg"},
               {.key = "final_mm", .heading = "final mm"},
               {.key = "final_deg"},
               {.key = "air_g", .heading = "air g", .effort = true},
               {.key = "switches", .whole = true, .heading = "switches"},
               {.key = "switches_per_s", .heading = "switches/s", .effort = true, .detail = false}};
  s.judged = {"rmse_mm", "true distance from the desired position"};
  s.conditions = {{"mass_factor", "", "mass_factor", "mass factor"}};
  s.consumption = {"air", "kg", "air_kg", "air"};
  s.timing = {0.01, 10};
  s.switches_key = "thrusters";
  s.switch_noun = "thruster";
  s.modes_key = "thrusters";
  return s;
}

}  // namespace

const SystemDescription& thrusters_description() {
  static const SystemDescription description = described_thrusters();
  return description;
}

Metrics evaluate_thrusters_run(std::span<const TickRecord> ticks, double tick_s, const Consumed& air_kg,
                               double deadline_us) {
  Metrics m;
  for (const MetricColumn& metric : thrusters_description().metrics) m[metric.key] = 0.0;
  const TrackingFigures f = tracking_figures(ticks, thrusters_description(), tick_s);
  m.finite = f.finite;
  if (ticks.empty()) return m;
  double final_distance = 0, final_angle = 0;
  int final_ticks = 0;
  for (const TickRecord& t : ticks) {
    const auto error = [&](std::size_t a) { return t.decision.reference.axis[a].value - t.sensors.truth[a]; };
    const double distance = std::hypot(error(0), error(1));
    m["largest_mm"] = std::max(m["largest_mm"], 1e3 * distance);
    if (t.sensors.time_s < ticks.back().sensors.time_s - 1.0) continue;
    final_distance += distance;
    final_angle += std::abs(error(2));
    ++final_ticks;
  }
  m["rmse_mm"] = 1e3 * std::hypot(f.axis[0].rms, f.axis[1].rms);
  m["rmse_deg"] = degrees_a_radian * f.axis[2].rms;
  m["largest_deg"] = degrees_a_radian * f.axis[2].largest;
  m["final_mm"] = 1e3 * final_distance / final_ticks;
  m["final_deg"] = degrees_a_radian * final_angle / final_ticks;
  m["air_g"] = 1e3 * air_kg.total;
  m["switches"] = f.switches;
  m["switches_per_s"] = f.switches / f.duration_s;
  add_solves(ticks, deadline_us, m);
  return m;
}

}  // namespace solenoid
