#pragma once

#include "experiments/plants/simulated_plant.hpp"
#include "experiments/systems/actuator/twin/twin_integrators.hpp"
#include "experiments/systems/actuator/twin/twin_sensing.hpp"

#include <optional>

namespace solenoid {

/// What a run asks of a twin: the task's plane and payload, and how far it departs from its parameters.
struct TwinCase {
  Plane plane = Plane::vertical;
  double payload_kg = 0.0;
  Mismatch mismatch;  ///< friction, flow, supply, delay and inertia of the twin's own parameters
};
TwinParameters twin_for(TwinParameters parameters, const TwinCase& task);

/// The truth plant: continuous time, commands through travelling valves, sensors through their chain
/// (docs/reference/twin.md). Starts at rest at `start_m`, both chambers at atmospheric pressure, coils off. The same
/// seed gives the same run to the last bit; noise does not change the valves' jitter.
class TwinPlant final : public SimulatedPlant {
 public:
  struct Sensing {
    bool ideal = false;  ///< controllers may read the true state
    bool noise = true;
    std::uint64_t seed = 1;
  };

  TwinPlant(const TwinParameters& parameters, const std::string& valves, double start_m, const Sensing& sensing);
  TwinPlant(const TwinPlant&) = delete;  // the integrator refers to the physics beside it
  TwinPlant& operator=(const TwinPlant&) = delete;

  Measurement read(double time_s) noexcept override;
  void write(const Command& command) noexcept override;
  double consumed() const override { return state_[twin_drawn]; }
  void fail_switch(std::size_t c, const SwitchFault& fault) noexcept override;
  /// supply: a factor on its gauge pressure, which the regulator has let go at once; chamber_a, chamber_b: a leak.
  void fail_part(std::string_view part, std::optional<double> value) noexcept override;

  const TwinState& state() const { return state_; }
  const TwinPhysics& physics() const { return physics_; }

 private:
  ActuatorState truth() const noexcept;

  TwinPhysics physics_;
  ModeSet modes_;
  TwinIntegrator integrator_;
  ValveActuation valves_;
  std::optional<ServoActuation> servo_;  // in place of valves_
  TwinState state_;
  SensingChain sensing_;
  bool ideal_;
  double motor_command_n_ = 0.0;
  std::int64_t intervals_ = 0;
  double sound_supply_pa_;
};

}  // namespace solenoid
