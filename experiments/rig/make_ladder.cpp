#include "experiments/rig/make_ladder.hpp"

#include "core/systems/actuator/valves.hpp"

namespace solenoid {

std::unique_ptr<FallbackLadder> make_ladder(const VariantConfig& variant, const Trajectory& reference, Plane plane,
                                            const LadderSettings& settings, const SolverDecorator& decorate) {
  ActuatorParameters nominal = variant.nominal;
  nominal.plane = plane;
  std::optional<MotorGains> motor;
  if (variant.hybrid()) motor = variant.motor_gains;
  return std::make_unique<FallbackLadder>(
      FallbackLadder::Parts{make_controller(variant, reference, plane, decorate), PneumaticActuator(nominal),
                            valve_modes(variant.valves, nominal), reference, motor, settings});
}

}  // namespace solenoid
