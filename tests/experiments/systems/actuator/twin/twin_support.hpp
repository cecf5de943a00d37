#pragma once

#include "core/config/reader.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/systems/actuator/twin/twin_plant.hpp"

#include <cmath>
#include <string>
#include <vector>

namespace solenoid {

/// A twin from the text of its parameter file.
inline TwinParameters twin_from(const std::string& text) {
  TableReader reader = TableReader::from_text(text, "twin.toml");
  return read_twin(reader);
}

/// Every effect on, with numbers that make each of them matter.
inline TwinParameters full_twin() {
  return twin_from(R"(
    actuator = { base = "inferred" }
    valves   = { travel_rise_s = 1e-3, travel_fall_s = 0.8e-3, jitter_sigma_s = 0.1e-3 }
    flow     = { law = "iso6358", critical_ratio = 0.4, laminar_from = 0.95 }
    thermal  = { law = "heat_transfer", heat_transfer_w_per_m2k = 60 }
    supply   = { law = "reservoir", volume_m3 = 1e-4, regulator_conductance = 1e-7 }
    friction = { law = "lugre" }
    gear     = { law = "backlash" }
    motor    = { lag_s = 0.5e-3 })");
}

/// Drives a state directly: no controller, sensors or ticks, one constant command at a time.
struct TwinBench {
  explicit TwinBench(const TwinParameters& parameters, const std::string& valves = "three_way", double y = 0.05)
      : physics(parameters),
        modes(valve_modes(valves, parameters.actuator)),
        integrator(physics, modes),
        actuation(modes, parameters.valves, 1),
        state(physics.state_at_rest(y)) {}

  void run(double duration_s, double motor_n = 0.0) {
    const double end_s = time_s + duration_s;
    const auto pieces = static_cast<int>(std::lround(duration_s / 1e-4));
    const double begin_s = time_s;
    for (int i = 0; i < pieces; ++i) {
      const double next = i + 1 == pieces ? end_s : begin_s + (i + 1) * 1e-4;
      integrator.advance(state, actuation, motor_n, time_s, next);
      time_s = next;
    }
  }
  void command(SwitchPattern coils) { actuation.command(coils, time_s); }

  TwinPhysics physics;
  ModeSet modes;
  TwinIntegrator integrator;
  ValveActuation actuation;
  TwinState state;
  double time_s = 0.0;
};

}  // namespace solenoid
