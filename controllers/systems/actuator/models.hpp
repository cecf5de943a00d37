#pragma once

#include "controllers/compiled_solvers.hpp"
#include "core/systems/actuator/residual_actuator.hpp"
#include "core/systems/actuator/servo_actuator.hpp"

#include <concepts>
#include <tuple>

namespace solenoid {

/// A model of the actuator: without and with the motor's law in the prediction.
template <class M>
concept ActuatorModel = HybridModel<M> && std::derived_from<M, PneumaticActuator>;

/// One on servo valves.
template <class M>
concept ServoModel = ActuatorModel<M> && std::derived_from<M, ServoActuator>;

/// One with an identified residual.
template <class M>
concept ResidualModel = ActuatorModel<M> && std::derived_from<M, ResidualActuator>;

/// Of the mode sets whose valves have one degree of freedom each: of four coils, three_way and three_mode; SQP also of
/// two_way.
template <ActuatorModel M>
struct RelaxedSizes<M> {
  using Sqp = std::tuple<SqpSize<2, 2>, SqpSize<4, 4>>;
  using Ipopt = std::tuple<SqpSize<2, 2>>;
};
/// Without a switch: continuous inputs alone.
template <ServoModel M>
struct RelaxedSizes<M> {
  using Sqp = std::tuple<SqpSize<0, 0>>;
  using Ipopt = std::tuple<>;
};
/// None: a residual has kinks at its knots, and what searches modes needs no derivative of it.
template <ResidualModel M>
struct RelaxedSizes<M> {
  using Sqp = std::tuple<>;
  using Ipopt = std::tuple<>;
};

}  // namespace solenoid
