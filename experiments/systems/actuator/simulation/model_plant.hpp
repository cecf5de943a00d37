#pragma once

#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/plants/simulated_plant.hpp"
#include "experiments/systems/actuator/simulation/model_sensing.hpp"

#include <limits>
#include <optional>
#include <random>

namespace solenoid {

/// Sensor noise of the simple plant: white, before the controller's filter (model.md, section 6).
struct SensorNoise {
  double position_sigma_m = 0.03e-3;
  double pressure_sigma_pa = 300.0;
};

/// The controller's own equations as the plant: explicit Euler at the tick, commands through the delays of its valves.
/// On servo valves with all that they are (servo_valve.hpp), and their openings behind the actuator's own true state.
/// Starts at rest at `start_m`, both chambers at atmospheric pressure, coils off.
class ModelPlant final : public SimulatedPlant {
 public:
  struct Sensing {
    bool ideal = true;  ///< controllers may read the true state
    bool noise = false;
    bool chain = false;  ///< the rig's whole sensing chain in place of `noise` and `sigma`
    SensorNoise sigma{};
    std::uint64_t seed = 1;
  };

  ModelPlant(const ActuatorParameters& parameters, const std::string& valves, double start_m, const Sensing& sensing,
             double tick_s = actuator_timing.tick_s);

  Measurement read(double time_s) noexcept override;
  void write(const Command& command) noexcept override;
  void fail_switch(std::size_t c, const SwitchFault& fault) noexcept override;
  /// supply: a factor on its gauge pressure; chamber_a, chamber_b: a leak, as a share of an exhaust's opening.
  void fail_part(std::string_view part, std::optional<double> value) noexcept override;

  /// An external force [N] on the slide from now on: what a test draws at random.
  void disturb(double force_n) noexcept { model_.set_load(model_.parameters().payload_mass_kg, force_n); }
  /// A blow to come: at `time_s` the slide's velocity changes by `speed_m_s` at once.
  void push_at(double time_s, double speed_m_s) noexcept {
    push_at_s_ = time_s;
    push_speed_m_s_ = speed_m_s;
  }

  const ActuatorState& state() const { return state_; }
  double consumed() const override { return air_kg_; }

 private:
  SwitchedOf<PneumaticActuator> openings() const noexcept;
  void advance_one_step() noexcept;

  PneumaticActuator model_;
  ModeSet modes_;
  SwitchTiming timing_;
  Sensing sensing_;
  ModelSensing chain_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  ActuatorState state_;
  DelayLines lines_{0};
  std::optional<ServoPair> servo_;  // in place of what is switched
  ContinuousValues continuous_{};
  double motor_force_n_ = 0.0, air_kg_ = 0.0;
  double push_at_s_ = std::numeric_limits<double>::infinity(), push_speed_m_s_ = 0.0;
  std::int64_t steps_done_ = 0;
  std::array<SwitchFault, max_switches> faults_{};
  std::array<double, 2> leak_{};  // of chambers A and B
  double sound_supply_pa_;
  double tick_s_;
};

}  // namespace solenoid
