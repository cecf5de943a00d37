#pragma once

#include "core/actuator/dynamics.hpp"
#include "core/actuator/valves.hpp"
#include "core/rt/io.hpp"

#include <random>

namespace solenoid {

/// Sensor noise of the simple plant: white, before the controller's filter (model.md, section 7).
struct SensorNoise {
  double position_sigma_m = 0.03e-3;
  double pressure_sigma_pa = 300.0;
};

/// The controller's own equations as the plant: explicit Euler at T_s, commands through the delays of its valves.
/// Starts at rest at `start_m`, both chambers at atmospheric pressure, coils off.
class ModelPlant final : public Plant {
 public:
  struct Sensing {
    bool ideal = true;  ///< controllers may read the true state
    bool noise = false;
    SensorNoise sigma{};
    std::uint64_t seed = 1;
  };

  ModelPlant(const ActuatorParameters& parameters, const std::string& valves, double start_m, const Sensing& sensing);

  Sensors read(double time_s) noexcept override;
  void write(const Command& command) noexcept override;

  /// A blow: the slide's velocity changes by `speed_m_s` at once.
  void push(double speed_m_s) noexcept { state_[velocity] += speed_m_s; }

  const ActuatorState& state() const { return state_; }
  double air_used_kg() const { return air_kg_; }

 private:
  void advance_one_step() noexcept;

  PneumaticActuator model_;
  ModeSet modes_;
  SwitchTiming timing_;
  Sensing sensing_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  ActuatorState state_;
  SwitchLines lines_{0};
  double motor_force_n_ = 0.0, air_kg_ = 0.0;
  std::int64_t steps_done_ = 0;
};

}  // namespace solenoid
