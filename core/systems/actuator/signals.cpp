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
  s.outputs = {{0, 0, "position", "1/m2"}, {0, 1, "velocity", "s2/m2"}};
  s.metrics = {{.key = "rmse_mm", .heading = "RMSE mm"},
               {.key = "mae_mm", .heading = "MAE mm"},
               {.key = "rmse_measured_mm", .heading = "measured RMSE"},
               {.key = "mae_measured_mm", .meaning = "MAE, measured"},
               {.key = "sse_mean_abs_mm", .meaning = "steady state: mean |error|"},
               {.key = "sse_abs_mean_mm", .meaning = "steady state: |mean error|"},
               {.key = "sse_max_abs_mm", .meaning = "steady state: largest error"},
               {.key = "ssa_mm", .meaning = "steady state: swing"},
               {.key = "itae"},
               {.key = "overshoot_percent", .meaning = "overshoot, %"},
               {.key = "coil_switches", .whole = true, .heading = "switches"},
               {.key = "switches_per_s", .heading = "switches/s", .effort = true, .detail = false},
               {.key = "steady_switches_per_s"},
               {.key = "busiest_coil_per_s", .meaning = "changes of the coil that changes most, 1/s"},
               {.key = "life_years",
                .best_least = false,
                .meaning = "until that coil's rated life ends, years of running",
                .harmonic = true},
               {.key = "valves_usd", .meaning = "price of the valves, USD"},
               {.key = "air_g", .heading = "air g", .effort = true},
               {.key = "air_nl"},
               {.key = "steady_air_g_per_s"},
               {.key = "motor_rms_n", .heading = "motor N", .best_least = false}};
  s.judged = {"rmse_mm", "true position error"};
  s.conditions = {{"payload", "kg", "payload_kg", "payload"}};
  s.consumption = {"air", "kg", "air_kg", "supply air"};
  s.timing = actuator_timing;
  s.switches_key = "coils";
  s.switch_noun = "coil";
  s.modes_key = "valves";
  s.rung_names = {"fresh", "shifted", "dmpc", "motor", "safe"};
  s.axis_limit_name = "position limit";
  s.channel_limit_name = "pressure limit";
  return s;
}

SystemDescription described_on_servo_valves() {
  SystemDescription s = described();
  for (const char* chamber : {"a", "b"}) {
    const std::string name = std::string("valve_") + chamber, label = chamber[0] == 'a' ? "valve A" : "valve B";
    s.continuous.push_back({name, "1", name, label});
    s.decided_keys.push_back(name + "_decided");
  }
  return s;
}

}  // namespace

const SystemDescription& servo_description() {
  static const SystemDescription description = described_on_servo_valves();
  return description;
}

const SystemDescription& actuator_description() {
  static const SystemDescription description = described();
  return description;
}

}  // namespace solenoid
