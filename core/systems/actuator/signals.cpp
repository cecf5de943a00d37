#include "core/systems/actuator/signals.hpp"

namespace solenoid {
namespace {

SystemDescription described() {
  SystemDescription s;
  s.name = "actuator";
  s.summary =
      "a pneumatic cylinder on on/off valves with a DC motor in parallel, driving an arm: the 2011 thesis's rig";
  s.states = {{"position", "m", "true_position_m", "position", "position"},
              {"velocity", "m/s", "true_velocity_m_s", "velocity", "velocity"},
              {"pressure_a", "Pa", "true_pressure_a_pa", "pressure A", "pressure"},
              {"pressure_b", "Pa", "true_pressure_b_pa", "pressure B", "pressure"}};
  s.estimate_keys = {"estimate_m", "estimate_m_s", "estimate_a_pa", "estimate_b_pa"};
  s.channels = {{"position", "m", "position_m", "position", "measured"},
                {"pressure_a", "Pa", "pressure_a_pa", "pressure A", "measured, absolute"},
                {"pressure_b", "Pa", "pressure_b_pa", "pressure B", "measured, absolute"}};
  s.continuous = {{"motor", "N", "motor_n", "motor"}};
  s.decided_keys = {"motor_decided_n"};
  s.beliefs = {{"payload", "kg", "payload_kg", "payload"}, {"disturbance", "N", "disturbance_n", "disturbance"}};
  s.axes = {
      {{"position", "m", "reference_m", "position", "desired position"}, "mm", 1e3, "velocity", "offset_m", 0.05}};
  s.reference_keys = {"reference_m", "reference_m_s"};
  s.outputs = {{0, 0}, {0, 1}};
  for (const char* metric :
       {"rmse_mm", "mae_mm", "rmse_measured_mm", "mae_measured_mm", "sse_mean_abs_mm", "sse_abs_mean_mm",
        "sse_max_abs_mm", "ssa_mm", "itae", "overshoot_percent", "coil_switches", "switches_per_s",
        "steady_switches_per_s", "air_g", "air_nl", "steady_air_g_per_s", "motor_rms_n"})
    s.metrics.push_back({metric, metric == std::string("coil_switches")});
  s.timing = actuator_timing;
  s.switches_key = "coils";
  s.switch_noun = "coil";
  return s;
}

}  // namespace

const SystemDescription& actuator_description() {
  static const SystemDescription description = described();
  return description;
}

}  // namespace solenoid
