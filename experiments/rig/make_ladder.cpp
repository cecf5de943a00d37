#include "experiments/rig/make_ladder.hpp"

#include "core/actuator/valves.hpp"

namespace solenoid {

std::unique_ptr<FallbackLadder> make_ladder(const VariantConfig& variant, const Trajectory& reference, Plane plane,
                                            const LadderSettings& settings, const SolverDecorator& decorate) {
  ActuatorParameters believed = variant.believed;
  believed.plane = plane;
  std::optional<MotorGains> motor;
  if (variant.hybrid()) motor = variant.motor_gains;
  return std::make_unique<FallbackLadder>(
      FallbackLadder::Parts{make_controller(variant, reference, plane, decorate), PneumaticActuator(believed),
                            valve_modes(variant.valves, believed), reference, motor, settings});
}

}  // namespace solenoid
