#include "controllers/systems/actuator/actuator_keys.hpp"

#include "controllers/systems/actuator/actuator_variant.hpp"

namespace solenoid {
namespace {

constexpr double longest_pulse_period_ticks = 200;

// Where a key's value lives in the variant.
#define OWN(member)                                                                \
  VariantKey::At<std::decay_t<decltype(std::declval<ActuatorVariant&>().member)>>( \
      [](VariantConfig& v) -> decltype((actuator(v).member)) { return actuator(v).member; })

void add_motor(const KeyGroup& all) {
  all.by_hand("residual", "none", "a file in .toml, a table",
              "a force that the model leaves out, identified from logs, in prediction and estimator: "
              "docs/how-to/residual.md");
  all.by_hand("use_estimate", "\"state\"", "state, payload, disturbance, payload_and_disturbance",
              "what of the estimate the prediction, and a motor law with inverse dynamics, uses");
  all.text(
      "motor", OWN(motor), {"none", "pd", "inverse_dynamics", "in_prediction", "joint"},
      "the motor's law; `in_prediction`: pd, and the prediction knows it; `joint`: a planned force, on top of that "
      "law, or in its place with `sqp` and `ipopt`");
  all.flag("valve_health", OWN(valve_health),
           "whether coils that are stuck, leak or are slow are found from the pressures and done without");
  all.add("motor_gains.proportional", OWN(motor_gains.proportional), Range::non_negative(), "N/m", "K_pe");
  all.add("motor_gains.derivative", OWN(motor_gains.derivative), Range::non_negative(), "N s/m", "K_de");
}

void add_cost_of_end(const KeyGroup& cost_of_end) {
  const Range weight = Range::non_negative();
  cost_of_end.add("cost.terminal_acceleration", OWN(terminal_acceleration), weight, "s4/m2",
                  "of the squared acceleration error at the last step, what the pressures there bring about");
}

void add_pulse_width(const KeyGroup& law) {
  const Range gain = Range::non_negative(), share = Range::between(0.0, 1.0);
  law.add("pulse_width.proportional", OWN(pulse_width.proportional), gain, "1/m",
          "gain on the position error; duties are of full scale, -1 to 1");
  law.add("pulse_width.integral", OWN(pulse_width.integral), gain, "1/(m s)", "gain");
  law.add("pulse_width.derivative", OWN(pulse_width.derivative), gain, "s/m", "gain");
  law.add("pulse_width.integral_limit", OWN(pulse_width.integral_limit), share, "", "bound of the integral's share");
  law.add("pulse_width.feedforward", OWN(pulse_width.feedforward), gain, "1/m",
          "gain on the desired position's change over the coming lead_s");
  law.add("pulse_width.lead_s", OWN(pulse_width.lead_s), share, "s", "of the feedforward");
  law.add("pulse_width.friction", OWN(pulse_width.friction), share, "", "share against Coulomb friction");
  law.add("pulse_width.friction_band_m", OWN(pulse_width.friction_band_m), gain, "m",
          "errors that are left alone at rest");
  law.add("pulse_width.bias", OWN(pulse_width.bias), share, "", "duty of both valves at u = 0");
  law.add("pulse_width.period_ticks", OWN(pulse_width.period_ticks), Range::between(5, longest_pulse_period_ticks),
          "ticks", "of the pulses and of the law");
}

void add_sliding(const KeyGroup& surface, const KeyGroup& phases) {
  const Range gain = Range::non_negative();
  surface.add("sliding.frequency", OWN(sliding.frequency), Range::positive(), "rad/s", "omega of the surface");
  surface.add("sliding.damping", OWN(sliding.damping), gain, "", "zeta of the surface");
  surface.add("sliding.dead_band_m", OWN(sliding.dead_band_m), gain, "m",
              "of the surface, within which every valve is closed");
  surface.add("sliding.every_ticks", OWN(sliding.every_ticks), Range::between(1, longest_pulse_period_ticks), "ticks",
              "between decisions");
  phases.add("phases.coarse_above_m", OWN(phases.coarse_above_m), Range::positive(), "m",
             "errors at which the cylinder comes in");
  phases.add("phases.fine_below_m", OWN(phases.fine_below_m), gain, "m",
             "errors at which it is left at rest, at most coarse_above_m");
  phases.text("phases.rest", OWN(phases.rest), {"closed", "exhaust"},
              "the chambers when the motor is alone; `exhaust` with two_way valves");
}

void add_seven_mode(const KeyGroup& law) {
  law.add("seven_mode.full_above_m", OWN(seven_mode.full_above_m), Range::positive(), "m",
          "of the surface, beyond which both chambers act, at least sliding.dead_band_m; below it one does");
  law.add("seven_mode.mean_pressure_pa", OWN(seven_mode.mean_pressure_pa), Range::positive(), "Pa",
          "absolute: below it that one fills, above it it exhausts");
}

void add_end_position(const KeyGroup& law) {
  const Range any = Range::non_negative();
  law.add("end_position.lead_s", OWN(end_position.lead_s), Range::between(0.0, 60.0), "s",
          "how far ahead of the desired position the target is");
  law.add("end_position.start_m", OWN(end_position.start_m), Range::positive(), "m", "errors that start the slide");
  law.add("end_position.stop_m", OWN(end_position.stop_m), any, "m",
          "before the target at which every valve closes, at most start_m");
  law.add("end_position.anticipation_s", OWN(end_position.anticipation_s), any, "s",
          "of the way at the present speed, added to that");
  law.add("end_position.cushion_m", OWN(end_position.cushion_m), any, "m",
          "before the target in which the chamber ahead is closed");
  law.add("end_position.exhaust_share", OWN(end_position.exhaust_share), Range::between(0.0, 1.0), "",
          "of each period in which the chamber ahead exhausts: its flow control");
  law.add("end_position.period_ticks", OWN(end_position.period_ticks), Range::between(1, longest_pulse_period_ticks),
          "ticks", "of these pulses");
}

void add_servo_pid(const KeyGroup& law) {
  const Range gain = Range::non_negative();
  law.add("servo_pid.proportional", OWN(servo_pid.proportional), gain, "1/m",
          "gain on the position error; openings are of full scale, -1 to 1");
  law.add("servo_pid.integral", OWN(servo_pid.integral), gain, "1/(m s)", "gain");
  law.add("servo_pid.integral_limit", OWN(servo_pid.integral_limit), Range::between(0.0, 1.0), "",
          "bound of the integral's share");
  law.add("servo_pid.derivative", OWN(servo_pid.derivative), gain, "s/m", "gain on the velocity error");
  law.add("servo_pid.acceleration", OWN(servo_pid.acceleration), gain, "s2/m",
          "gain on the acceleration error, what the pressures bring about");
  law.add("servo_pid.feedforward", OWN(servo_pid.feedforward), gain, "s/m", "gain on the desired velocity");
}

void add_servo(const KeyGroup& planned, const KeyGroup& all) {
  planned.add("servo.effort", OWN(servo.effort), Range::non_negative(), "",
              "weight of the squared opening of each servo valve, at each step");
  all.add(
      "servo.compensation", OWN(servo.compensation), Range::between(0.0, 0.5), "",
      "overlap of a servo valve that its command makes up for; what the valve is believed to have is `model.servo`");
  all.add("servo.transition", OWN(servo.transition), Range::between(0.0, 0.5), "",
          "opening over which that is rounded off");
}

void add_estimation(const KeyGroup& all) {
  const Range positive = Range::positive(), not_negative = Range::non_negative(), memory = {0.005, 1e6, true};
  all.add("estimation.position_sigma_m", OWN(estimation.position_sigma_m), positive, "m",
          "white noise of the potentiometer");
  all.add("estimation.position_quantum_m", OWN(estimation.position_quantum_m), not_negative, "m", "converter step");
  all.add("estimation.position_low_m", OWN(estimation.position_low_m), Range::any(), "m",
          "the least its channel can show");
  all.add("estimation.position_high_m", OWN(estimation.position_high_m), {-10.0, 10.0}, "m",
          "the most, above position_low_m");
  all.add("estimation.pressure_low_pa", OWN(estimation.pressure_low_pa), Range::any(), "Pa",
          "the least the sensors can show, absolute");
  all.add("estimation.pressure_high_pa", OWN(estimation.pressure_high_pa), {-1e7, 1e7}, "Pa",
          "the most, above pressure_low_pa");
  all.add("estimation.pressure_filter_hz", OWN(estimation.pressure_filter_hz), Range::between(0.0, 400.0), "Hz",
          "cut-off of the hardware Bessel filter; 0: none");
  all.add("estimation.pressure_sigma_pa", OWN(estimation.pressure_sigma_pa), positive, "Pa", "noise after the filter");
  all.add("estimation.pressure_input_sigma_pa", OWN(estimation.pressure_input_sigma_pa), not_negative, "Pa",
          "noise and spikes before it, as white noise held for a tick");
  all.add("estimation.gate_sigmas", OWN(estimation.gate_sigmas), positive, "",
          "standard deviations from which innovations lose weight");
  all.add("estimation.force_sigma_n", OWN(estimation.force_sigma_n), not_negative, "N", "external force, stationary");
  all.add("estimation.payload_mean_kg", OWN(estimation.payload_mean_kg), not_negative, "kg", "payload expected");
  all.add("estimation.payload_sigma_kg", OWN(estimation.payload_sigma_kg), not_negative, "kg",
          "its standard deviation; 0: fixed");
  all.add("estimation.payload_drift", OWN(estimation.payload_drift), not_negative, "kg/s^0.5",
          "how fast it may change");
  all.add("estimation.flow_sigma", OWN(estimation.flow_sigma), not_negative, "",
          "of the valves' flow factor; 0: fixed");
  all.add("estimation.friction_sigma", OWN(estimation.friction_sigma), not_negative, "",
          "of the friction factor; 0: fixed");
  all.add("estimation.pressure_drift_pa", OWN(estimation.pressure_drift_pa), positive, "Pa/s^0.5", "unmodelled flow");
  all.add("estimation.force_white_n", OWN(estimation.force_white_n), positive, "N", "unmodelled force of one tick");
  all.add("estimation.force_memory_s", OWN(estimation.memory.force_s), memory, "s",
          "time constant of the external force");
  all.add("estimation.flow_memory_s", OWN(estimation.memory.flow_s), memory, "s", "of the flow factor");
  all.add("estimation.friction_memory_s", OWN(estimation.memory.friction_s), memory, "s", "of the friction factor");
  all.add("estimation.window_ticks", OWN(estimation.window_ticks), Range::between(20, 50), "ticks", "of `mhe`");
  all.add("estimation.iterations", OWN(estimation.iterations), Range::between(1, 5), "", "of `mhe`, a tick");
}
#undef OWN

}  // namespace

std::vector<VariantKey> actuator_keys() {
  std::vector<VariantKey> keys;
  add_motor({keys, ""});
  add_cost_of_end({keys, "extended_cost"});
  add_pulse_width({keys, "pulse_width"});
  add_sliding({keys, "sliding"}, {keys, "phases"});
  add_seven_mode({keys, "seven_mode"});
  add_end_position({keys, "end_position"});
  add_servo_pid({keys, "servo_pid"});
  add_servo({keys, "servo_effort"}, {keys, "servo"});
  add_estimation({keys, "estimation"});
  return keys;
}

}  // namespace solenoid
